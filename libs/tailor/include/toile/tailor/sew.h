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

/// A place on each side that must come together: `panel.point`, or `panel.edge(place)` with a place as in ranges.
struct MatchPoint {
  std::string a, b;
  static void describe(auto& f) {
    f(&MatchPoint::a, {.key = "a", .doc = "place on side a: panel.point or panel.edge(120 mm)", .required = true});
    f(&MatchPoint::b, {.key = "b", .doc = "place on side b, or on a further side", .required = true});
  }
};

/// Where along a side the difference of the lengths is laid.
struct EaseZone {
  std::string from, to;
  double share = 1;
  static void describe(auto& f) {
    f(&EaseZone::from, {.key = "from", .doc = "place where it begins: panel.point or panel.edge(120 mm)", .required = true});
    f(&EaseZone::to, {.key = "to", .doc = "place where it ends, on the same side", .required = true});
    f(&EaseZone::share, {.key = "share", .doc = "part of the difference between match points that is laid here; the rest is spread evenly beside it", .unit = "1", .min = 0, .max = 1});
  }
};

struct SeamSpec {
  std::string name;
  std::vector<std::string> a, b;
  std::vector<std::vector<std::string>> more;
  std::string kind = "plain";
  std::optional<double> ease;
  std::optional<double> gather;
  std::vector<EaseZone> ease_at;
  std::vector<MatchPoint> match;
  bool same_direction = false;
  bool pleated = false;
  std::optional<double> bending_factor;
  std::optional<double> angle;
  std::optional<SeamTape> tape;
  std::optional<SeamThread> thread, elastic;
  std::optional<Allowance> allowance;
  std::optional<double> allowance_width;
  static void describe(auto& f) {
    f(&SeamSpec::name, {.key = "name", .doc = "unique name", .required = true});
    f(&SeamSpec::a, {.key = "a", .doc = "edges of the first side in sewing order: panel.edge, or a part of it, panel.edge(from..to), between named points, lengths (120 mm, negative: before the end) or percentages (25 %); '-' before one runs it backwards", .required = true});
    f(&SeamSpec::b, {.key = "b", .doc = "edges of the second side, in the same sewing direction", .required = true});
    f(&SeamSpec::more, {.key = "more", .doc = "further sides, where three and more edges meet in one seam"});
    f(&SeamSpec::kind, {.key = "kind", .doc = "plain, felled, taped, dart, gathered, ... (free text, kept in the garment)"});
    f(&SeamSpec::ease, {.key = "ease", .doc = "length difference of the sides that is intended", .unit = "m", .min = 0, .max = 10});
    f(&SeamSpec::gather, {.key = "gather", .doc = "intended ratio of the longer side to the shorter one, instead of ease", .unit = "1", .min = 1, .max = 3});
    f(&SeamSpec::ease_at, {.key = "ease_at", .doc = "where along a side the difference is laid; otherwise evenly between match points"});
    f(&SeamSpec::match, {.key = "match", .doc = "places of the sides that come together"});
    f(&SeamSpec::same_direction, {.key = "same_direction", .doc = "the face of one cloth meets the back of the other: both sides run the same way round their panels"});
    f(&SeamSpec::pleated, {.key = "pleated", .doc = "one side lies in its pleats: the hidden cloth is caught in the seam, pleats are stitched down as far as their lines go"});
    f(&SeamSpec::bending_factor, {.key = "bending_factor", .doc = "bending stiffness along the seam over the cloth's", .unit = "1", .min = 0.1, .max = 1000});
    f(&SeamSpec::angle, {.key = "angle", .doc = "angle at rest between sides a and b; positive: towards the face side", .unit = "rad", .min = -3.14, .max = 3.14});
    f(&SeamSpec::tape, {.key = "tape", .doc = "a tape sewn into the seam"});
    f(&SeamSpec::thread, {.key = "thread", .doc = "the thread of the seam, where it is tighter or looser than the cloth"});
    f(&SeamSpec::elastic, {.key = "elastic", .doc = "an elastic sewn into the seam"});
    f(&SeamSpec::allowance, {.key = "allowance", .doc = "how the allowances lie: none, open (pressed apart), to_a, to_b, felled (what a seam of kind felled has); they weigh and stiffen the seam"});
    f(&SeamSpec::allowance_width, {.key = "allowance_width", .doc = "their width, or that of the fell; without it what the pattern says, of darts the cloth between the legs", .unit = "m", .min = 0, .max = 0.5});
    f.check([](const SeamSpec& seam, Issues& issues) {
      if (seam.ease && seam.gather) issues.push_back({"ease_and_gather", {.item = "gather"}, "ease and gather are both given", "ease says the difference of the lengths, gather their ratio: keep one"});
    });
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
  std::string name;                   ///< of the row in the garment's `seams`
  double length_a = 0, length_b = 0;  ///< along the true curves [m]
  double allowed = 0;                 ///< difference that was allowed: tolerance, ease or gather [m]
  double steepest = 1;                ///< largest ratio of the two sides between places that come together
  int pairs = 0;                      ///< particles along the seam
  int added = 0;                      ///< of the vertices on either side those that were put in
  double farthest_slide = 0;          ///< [m]
};

/// One place along a seam: the vertices of either side there, two where one edge ends and the next begins.
struct SeamPlace {
  std::vector<int> a, b;
};

struct Sewn {
  mesh::GarmentMesh garment;
  std::vector<SeamReport> seams;              ///< one for each row of garment.seams
  std::vector<std::vector<SeamPlace>> lines;  ///< by seam, all places in order, also those that need no weld (the tip of a dart)
  Issues notes;                               ///< what deserves a look: "turned_ring"
};

/// The seams alone; folds and trims come after, by add_folds() and add_trims().
/// Pairs of a garment's vertices become the same particle; the side with fewer particles gets more, and so does every
/// edge that is sewn to it elsewhere; the triangles around are set anew. Panels stay flat. A further side of a seam is a row
/// of its own in garment.seams, NAME_side_3 and so on, of kind "further". The result does not depend on the order of the seams.
/// garment  flat panels as from mesh_panels(), without laminates
/// error    "unknown_panel", "unknown_edge", "unknown_point", "bad_reference", "bad_range", "duplicate_name", "empty_seam",
///          "same_edge", "already_sewn", "not_flat", "unsupported_columns", "already_layered", "already_folded", "seam_length", "twisted_seam",
///          "bad_match", "bad_ease", "steep_ease", "chain_order", "sewn_twice", "seam_conflict", "degenerate_face", "folded_panel"
Result<Sewn> sew(const mesh::GarmentMesh& garment, const SewParams& params);

}  // namespace toile::tailor

template <>
struct toile::Choices<toile::tailor::Matching> {
  static constexpr std::array names{std::pair{"aligned", toile::tailor::Matching::aligned},
                                    std::pair{"published", toile::tailor::Matching::published}};
};
