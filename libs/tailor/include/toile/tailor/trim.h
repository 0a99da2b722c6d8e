// Line-like materials: tapes, threads and allowances of seams, elastic bands, drawstrings (docs/tailoring.md, "Seam kinds"
// and "Trims").
#pragma once

#include "toile/base/fields.h"
#include "toile/base/result.h"
#include "toile/mesh/garment_mesh.h"

#include <array>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace toile::tailor {

enum class TrimKind { tape, elastic, drawstring };

struct TrimSpec {
  std::string name;
  TrimKind kind = TrimKind::tape;
  std::vector<std::string> along;
  double ratio = 1;
  double stretch = 0;
  double bending = 0;
  double mass = 0;
  double width = 0;
  std::optional<bool> slack;
  static void describe(auto& f) {
    f(&TrimSpec::name, {.key = "name", .doc = "unique name", .required = true});
    f(&TrimSpec::kind, {.key = "kind", .doc = "tape, elastic or drawstring"});
    f(&TrimSpec::along, {.key = "along", .doc = "edges and inner lines in order: panel.line, '-' before one runs it backwards", .required = true});
    f(&TrimSpec::ratio, {.key = "ratio", .doc = "its length at rest over that of the cloth under it", .unit = "1", .min = 0.05, .max = 5});
    f(&TrimSpec::stretch, {.key = "stretch", .doc = "force per strain", .unit = "N", .min = 0, .max = 1e6});
    f(&TrimSpec::bending, {.key = "bending", .doc = "moment per curvature, out of the cloth's plane", .unit = "N*m2", .min = 0, .max = 10});
    f(&TrimSpec::mass, {.key = "mass", .doc = "mass per length of the cloth under it", .unit = "kg/m", .min = 0, .max = 10});
    f(&TrimSpec::width, {.key = "width", .doc = "width, for the bill of materials", .unit = "m", .min = 0, .max = 1});
    f(&TrimSpec::slack, {.key = "slack", .doc = "pulls only, never pushes; elastics and drawstrings are slack unless this says no, tapes are not unless it says yes"});
  }
};

/// A tape sewn into a seam.
struct SeamTape {
  double width = 0;
  double bending = 0;
  double stretch = 0;
  double mass = 0;
  double ratio = 1;
  static void describe(auto& f) {
    f(&SeamTape::width, {.key = "width", .doc = "width", .unit = "m", .min = 1e-4, .max = 0.5, .required = true});
    f(&SeamTape::bending, {.key = "B", .doc = "bending rigidity per width", .unit = "N*m", .min = 0, .max = 10});
    f(&SeamTape::stretch, {.key = "stretch", .doc = "force per strain", .unit = "N", .min = 0, .max = 1e6});
    f(&SeamTape::mass, {.key = "mass", .doc = "mass per length", .unit = "kg/m", .min = 0, .max = 10});
    f(&SeamTape::ratio, {.key = "ratio", .doc = "its length at rest over that of the seam", .unit = "1", .min = 0.5, .max = 1.5});
  }
};

/// The thread of a seam, or an elastic sewn into it: pulls only.
struct SeamThread {
  double ratio = 1;
  double stretch = 0;
  double mass = 0;
  static void describe(auto& f) {
    f(&SeamThread::ratio, {.key = "ratio", .doc = "its length at rest over that of the seam: below 1 it draws the seam in, above 1 the seam gives so far", .unit = "1", .min = 0.05, .max = 5, .required = true});
    f(&SeamThread::stretch, {.key = "stretch", .doc = "force per strain", .unit = "N", .min = 0, .max = 1e6, .required = true});
    f(&SeamThread::mass, {.key = "mass", .doc = "mass per length", .unit = "kg/m", .min = 0, .max = 10});
  }
};

/// Where the allowances of a seam lie.
enum class Allowance {
  none,    ///< cut off, or of no account
  open,    ///< pressed apart, each on its own panel
  to_a,    ///< both on the first panel
  to_b,    ///< both on the second
  felled,  ///< the first one folded over the second and stitched down
};

struct TrimReport {
  std::string name, kind;
  double length = 0;  ///< of the cloth under it [m]
  int segments = 0;
};

struct Trimmed {
  mesh::GarmentMesh garment;
  std::vector<TrimReport> trims;
};

struct SeamSpec;

/// Adds the tapes, threads, elastics and allowances that seams ask for, and hinges where they ask for an angle, in the order of
/// the seams' names. Seams that ask for nothing are left as they are. Tapes, threads and elastics lie on side a (of a pleated
/// seam on the side without pleats).
/// garment  sewn by these specs
/// error    "unknown_seam", "untaped", "no_allowance", "duplicate_name", "angle_without_border", "angle_with_pleats", and
///          those of references
Result<Trimmed> finish_seams(const mesh::GarmentMesh& garment, const std::vector<SeamSpec>& seams);

/// Adds trims along chains of edges and inner lines, in the order of their names. Each line must begin in the particle where
/// the one before ends.
/// error  "duplicate_name", "no_line", "broken_chain", and those of references
Result<Trimmed> add_trims(const mesh::GarmentMesh& garment, const std::vector<TrimSpec>& trims);

/// Fills in what the allowances weigh and how stiff they are, from the cloth of their panels. May be done again after a change
/// of fabrics. Allowances of panels without a laminate stay as they are.
/// Source: docs/tailoring.md, "Seam kinds"
mesh::GarmentMesh resolve_allowances(const mesh::GarmentMesh& garment);

}  // namespace toile::tailor

template <>
struct toile::Choices<toile::tailor::TrimKind> {
  static constexpr std::array names{std::pair{"tape", toile::tailor::TrimKind::tape}, std::pair{"elastic", toile::tailor::TrimKind::elastic},
                                    std::pair{"drawstring", toile::tailor::TrimKind::drawstring}};
};
template <>
struct toile::Choices<toile::tailor::Allowance> {
  static constexpr std::array names{std::pair{"none", toile::tailor::Allowance::none}, std::pair{"open", toile::tailor::Allowance::open},
                                    std::pair{"to_a", toile::tailor::Allowance::to_a}, std::pair{"to_b", toile::tailor::Allowance::to_b},
                                    std::pair{"felled", toile::tailor::Allowance::felled}};
};
