#include "toile/form/measurements.h"

#include <cmath>

namespace toile::form {

void Measurements::check_together(const Measurements& m, Issues& issues) {
  const auto mm = [](double metres) { return fmt::format("{:.0f} mm", metres * 1000); };
  const auto between = [&](const char* key, double value, double low, double high, const char* why) {
    if (value >= low && value <= high) return;
    issues.push_back(Issue{"implausible_measurement", {.item = key}, fmt::format("{} is {}", key, mm(value)),
                           fmt::format("{}: expected {} to {}; check the value and its unit", why, mm(low), mm(high))});
  };
  between("waist", m.waist, 0.55 * m.chest, 1.35 * m.chest, "against the chest");
  between("hips", m.hips, 0.8 * m.waist, 1.6 * m.waist, "against the waist");
  between("seat", m.seat, 0.88 * m.hips, 1.35 * m.hips, "against the hips");
  between("neck", m.neck, 0.28 * m.chest, 0.52 * m.chest, "against the chest");
  between("biceps", m.biceps, 0.2 * m.chest, 0.46 * m.chest, "against the chest");
  between("wrist", m.wrist, 0.36 * m.biceps, 0.85 * m.biceps, "against the biceps");
  between("shoulderToShoulder", m.shoulderToShoulder, 0.3 * m.chest, 0.56 * m.chest, "against the chest");
  between("waistToSeat", m.waistToSeat, m.waistToHips + 0.02, m.waistToHips + 0.22, "the seat lies under the hips");
  between("waistToArmpit", m.waistToArmpit, 0.34 * m.hpsToWaistBack, 0.68 * m.hpsToWaistBack, "against hpsToWaistBack");
  between("hpsToBust", m.hpsToBust, 0.42 * m.hpsToWaistBack, 0.85 * m.hpsToWaistBack, "against hpsToWaistBack");
  between("hpsToWaistBack", m.hpsToWaistBack, 0.3 * m.waistToFloor, 0.62 * m.waistToFloor, "against waistToFloor");
  between("waistToSeat", m.waistToSeat, 0.1 * m.waistToFloor, 0.36 * m.waistToFloor, "against waistToFloor");
  between("shoulderToElbow", m.shoulderToElbow, 0.45 * m.shoulderToWrist, 0.68 * m.shoulderToWrist, "against shoulderToWrist");
  // Room for the arm between shoulder tip and armpit, estimated from the straight lengths.
  const double shoulder = 0.88 * m.hpsToWaistBack - std::tan(m.shoulderSlope) * (m.shoulderToShoulder / 2 - 0.16 * m.neck);
  const double depth = shoulder - m.waistToArmpit;
  if (depth < 0.38 * m.biceps) {
    issues.push_back(Issue{"implausible_measurement", {.item = "waistToArmpit"},
                           fmt::format("waistToArmpit of {} leaves {} between shoulder tip and armpit for an arm of {}", mm(m.waistToArmpit), mm(depth), mm(m.biceps)),
                           fmt::format("expected at least {}; check waistToArmpit, hpsToWaistBack, shoulderSlope and biceps", mm(0.38 * m.biceps))});
  }
  if (m.underbust) between("underbust", *m.underbust, 0.72 * m.chest, 1.0 * m.chest, "against the chest");
  if (m.waistToUnderbust) between("waistToUnderbust", *m.waistToUnderbust, 0.2 * m.waistToArmpit, 0.85 * m.waistToArmpit, "under the armpit");
  if (m.bustSpan) between("bustSpan", *m.bustSpan, 0.13 * m.chest, 0.26 * m.chest, "against the chest");
  if (m.waistToUpperLeg) between("waistToUpperLeg", *m.waistToUpperLeg, m.waistToSeat, m.waistToSeat + 0.16, "the leg begins under the seat");
}

}  // namespace toile::form
