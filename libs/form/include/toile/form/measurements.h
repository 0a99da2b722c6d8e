// Body measurements by their usual made-to-measure names, as pattern programs use them.
#pragma once

#include "toile/base/fields.h"

#include <optional>

namespace toile::form {

/// Girths and lengths [m] and the shoulder slope [rad]. What a form cannot do without is required; the rest refines it
/// or is carried for the pattern side. docs/form.md says how each is taken on the form.
struct Measurements {
  double chest = 0, waist = 0, hips = 0, seat = 0, neck = 0, biceps = 0, wrist = 0;
  double shoulderToShoulder = 0, shoulderSlope = 0, hpsToWaistBack = 0, hpsToBust = 0;
  double waistToArmpit = 0, waistToHips = 0, waistToSeat = 0, waistToFloor = 0;
  double shoulderToElbow = 0, shoulderToWrist = 0;
  // refine the form where given
  std::optional<double> underbust, waistToUnderbust, bustSpan, waistToUpperLeg;
  // of legs
  std::optional<double> ankle, inseam, knee, upperLeg, waistToKnee;
  // known, not used by the form
  std::optional<double> bustFront, bustPointToUnderbust, crossSeam, crossSeamFront, crotchDepth, head, heel, highBust,
      highBustFront, hpsToWaistFront, seatBack, stature, waistBack;

  static void describe(auto& f) {
    using M = Measurements;
    const auto girth = [&f](double M::*member, const char* key, const char* doc, double min, double max) {
      f(member, FieldInfo{.key = key, .doc = doc, .unit = "m", .min = min, .max = max, .required = true});
    };
    girth(&M::chest, "chest", "girth at the level of the bust points", 0.65, 1.7);
    girth(&M::waist, "waist", "girth at the natural waist", 0.5, 1.6);
    girth(&M::hips, "hips", "girth at the level waistToHips under the waist", 0.55, 1.7);
    girth(&M::seat, "seat", "girth at the fullest of the seat", 0.65, 1.8);
    girth(&M::neck, "neck", "girth of the neck at its base", 0.27, 0.56);
    girth(&M::biceps, "biceps", "girth of the upper arm", 0.18, 0.58);
    girth(&M::wrist, "wrist", "girth of the wrist", 0.11, 0.27);
    girth(&M::shoulderToShoulder, "shoulderToShoulder", "from one shoulder tip to the other", 0.28, 0.6);
    f(&M::shoulderSlope, {.key = "shoulderSlope", .doc = "angle of the shoulder line under the horizontal", .unit = "rad", .min = 0.1,
                          .max = 0.6, .required = true});
    girth(&M::hpsToWaistBack, "hpsToWaistBack", "from the high point of the shoulder down the back to the waist", 0.3, 0.62);
    girth(&M::hpsToBust, "hpsToBust", "from the high point of the shoulder to the bust point", 0.16, 0.45);
    girth(&M::waistToArmpit, "waistToArmpit", "height of the armpit over the waist", 0.1, 0.36);
    girth(&M::waistToHips, "waistToHips", "from the waist down to the hips", 0.05, 0.25);
    girth(&M::waistToSeat, "waistToSeat", "from the waist down to the seat", 0.1, 0.4);
    girth(&M::waistToFloor, "waistToFloor", "height of the waist over the floor", 0.6, 1.4);
    girth(&M::shoulderToElbow, "shoulderToElbow", "from the shoulder tip to the elbow", 0.2, 0.5);
    girth(&M::shoulderToWrist, "shoulderToWrist", "from the shoulder tip to the wrist", 0.36, 0.85);
    const auto maybe = [&f](std::optional<double> M::*member, const char* key, const char* doc, double min, double max) {
      f(member, FieldInfo{.key = key, .doc = doc, .unit = "m", .min = min, .max = max});
    };
    maybe(&M::underbust, "underbust", "girth of the rib cage under the bust", 0.55, 1.5);
    maybe(&M::waistToUnderbust, "waistToUnderbust", "height of the underbust over the waist", 0.03, 0.25);
    maybe(&M::bustSpan, "bustSpan", "distance of the bust points", 0.1, 0.35);
    maybe(&M::waistToUpperLeg, "waistToUpperLeg", "from the waist down to the top of the leg", 0.15, 0.45);
    const char* not_used = "known, not used by the form";
    maybe(&M::ankle, "ankle", "for legs: girth over the ankle", 0.1, 0.6);
    maybe(&M::bustFront, "bustFront", not_used, 0.2, 1);
    maybe(&M::bustPointToUnderbust, "bustPointToUnderbust", not_used, 0.02, 0.25);
    maybe(&M::crossSeam, "crossSeam", not_used, 0.3, 1.5);
    maybe(&M::crossSeamFront, "crossSeamFront", not_used, 0.1, 1);
    maybe(&M::crotchDepth, "crotchDepth", not_used, 0.1, 0.6);
    maybe(&M::head, "head", not_used, 0.4, 0.75);
    maybe(&M::heel, "heel", not_used, 0.2, 0.6);
    maybe(&M::highBust, "highBust", not_used, 0.6, 1.7);
    maybe(&M::highBustFront, "highBustFront", not_used, 0.2, 1);
    maybe(&M::hpsToWaistFront, "hpsToWaistFront", not_used, 0.25, 0.75);
    maybe(&M::inseam, "inseam", "for legs: height of the crotch over the floor", 0.4, 1.2);
    maybe(&M::knee, "knee", "for legs: girth of the knee", 0.2, 0.8);
    maybe(&M::seatBack, "seatBack", not_used, 0.2, 1);
    maybe(&M::stature, "stature", not_used, 1.1, 2.3);
    maybe(&M::upperLeg, "upperLeg", "for legs: girth of the thigh, 60 mm (times the body's size) under the crotch", 0.3, 1.1);
    maybe(&M::waistBack, "waistBack", not_used, 0.2, 0.9);
    maybe(&M::waistToKnee, "waistToKnee", "for legs: from the waist down to the knee", 0.3, 0.9);
    f.check([](const Measurements& m, Issues& issues) { check_together(m, issues); });
  }
  /// Measurements that contradict each other, one issue each.
  static void check_together(const Measurements& m, Issues& issues);
};

}  // namespace toile::form
