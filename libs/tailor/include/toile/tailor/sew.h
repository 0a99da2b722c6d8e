// Sews the edges of panels together (docs/tailoring.md, "Seams").
#pragma once

#include "toile/base/fields.h"
#include "toile/base/result.h"
#include "toile/mesh/garment_mesh.h"
#include "toile/tailor/fold.h"
#include "toile/tailor/trim.h"

#include <optional>
#include <string>
#include <vector>

namespace toile::tailor {

/// A place on each side that must come together, by named points (panel.point).
struct MatchPoint {
  std::string a, b;
  static void describe(auto& f) {
    f(&MatchPoint::a, {.key = "a", .doc = "named point on the first side: panel.point", .required = true});
    f(&MatchPoint::b, {.key = "b", .doc = "named point on the second side", .required = true});
  }
};

struct SeamSpec {
  std::string name;
  std::vector<std::string> a, b;
  std::string kind = "plain";
  std::optional<double> ease;
  std::optional<double> bending_factor;
  std::vector<MatchPoint> match;
  static void describe(auto& f) {
    f(&SeamSpec::name, {.key = "name", .doc = "unique name", .required = true});
    f(&SeamSpec::a, {.key = "a", .doc = "edges of the first side in sewing order, panel.edge; '-' before one runs it backwards", .required = true});
    f(&SeamSpec::b, {.key = "b", .doc = "edges of the second side, in the same sewing direction", .required = true});
    f(&SeamSpec::kind, {.key = "kind", .doc = "plain, dart, ... (free text, kept in the garment)"});
    f(&SeamSpec::ease, {.key = "ease", .doc = "length difference of the two sides that is intended", .unit = "m", .min = 0, .max = 10});
    f(&SeamSpec::bending_factor, {.key = "bending_factor", .doc = "bending stiffness along the seam over the cloth's", .unit = "1", .min = 0.1, .max = 1000});
    f(&SeamSpec::match, {.key = "match", .doc = "points of the two sides that come together"});
  }
};

/// Where the particles of the two sides meet.
enum class Matching {
  aligned,    ///< border particles slide along their edge until both sides have equal relative arc lengths: no built-in strain
  published,  ///< particles stay where they are and the nearest pair up in order
};

struct SewParams {
  std::vector<SeamSpec> seams;
  Matching matching = Matching::aligned;
  double tolerance = 0.01;
  double tolerance_max = 0.005;
  double bending_factor = 1;
  std::vector<FoldSpec> folds;
  std::vector<TrimSpec> trims;
  static void describe(auto& f) {
    f(&SewParams::seams, {.key = "seams", .doc = "list of seams; their order does not matter"});
    f(&SewParams::matching, {.key = "matching", .doc = "aligned: particles slide along their edge to equal relative arc length; published: they stay"});
    f(&SewParams::tolerance, {.key = "tolerance", .doc = "length difference that needs no declared ease, over the length", .unit = "1", .min = 0, .max = 1});
    f(&SewParams::tolerance_max, {.key = "tolerance_max", .doc = "and at most (half a millimetre is always allowed)", .unit = "m", .min = 0, .max = 1});
    f(&SewParams::bending_factor, {.key = "bending_factor", .doc = "bending stiffness along seams over the cloth's, where a seam says nothing", .unit = "1", .min = 0.1, .max = 1000});
    f(&SewParams::folds, {.key = "folds", .doc = "creases and rolls, along lines that are edges of the mesh"});
    f(&SewParams::trims, {.key = "trims", .doc = "tapes, elastic bands and drawstrings along edges and lines"});
  }
};

struct SeamReport {
  std::string name;
  double length_a = 0, length_b = 0;  ///< along the true curves [m]
  int pairs = 0;                      ///< particles along the seam
  int added = 0;                      ///< vertices put in on either side
  double farthest_slide = 0;          ///< [m]
};

struct Sewn {
  mesh::GarmentMesh garment;
  std::vector<SeamReport> seams;  ///< by name
};

/// The seams alone; folds and trims come after, by add_folds() and add_trims().
/// Pairs of a garment's border vertices become the same particle; the side with fewer particles gets more, the
/// triangles around are set anew. Panels stay flat. The result does not depend on the order of the seams.
/// garment  flat panels as from mesh_panels(), without laminates
/// error    "unknown_panel", "unknown_edge", "unknown_point", "bad_reference", "duplicate_name", "empty_seam",
///          "same_edge", "already_sewn", "not_flat", "unsupported_columns", "already_layered", "seam_length", "twisted_seam",
///          "bad_match", "seam_conflict", "degenerate_face", "folded_panel"
Result<Sewn> sew(const mesh::GarmentMesh& garment, const SewParams& params);

}  // namespace toile::tailor

template <>
struct toile::Choices<toile::tailor::Matching> {
  static constexpr std::array names{std::pair{"aligned", toile::tailor::Matching::aligned},
                                    std::pair{"published", toile::tailor::Matching::published}};
};
