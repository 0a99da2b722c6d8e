// Cuts a surface along named lines into pieces and lays them flat: from the form back to the pattern. docs/reshaping.md.
#pragma once

#include "toile/base/fields.h"
#include "toile/pattern/pattern.h"
#include "toile/reshape/surface.h"

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace toile::reshape {

/// A further named point of the surface.
struct PointSpec {
  std::string at;
  std::array<double, 3> shift{0, 0, 0};
  std::vector<std::string> between;
  double fraction = 0.5;
  static void describe(auto& f) {
    f(&PointSpec::at, {.key = "at", .doc = "a point that is known: a landmark, panel.point of a garment"});
    f(&PointSpec::shift, {.key = "shift", .doc = "moved from there; without `at` the position itself", .unit = "m", .min = -10, .max = 10});
    f(&PointSpec::between, {.key = "between", .doc = "or two points that it lies between"});
    f(&PointSpec::fraction, {.key = "fraction", .doc = "of the straight way from the first to the second", .unit = "1", .min = 0, .max = 1});
    f.check([](const PointSpec& p, Issues& issues) {
      if (!p.between.empty() && (p.between.size() != 2 || !p.at.empty())) {
        issues.push_back({"bad_point", {.item = "between"}, "it is not clear where the point is", "give `at` and `shift`, or two points in `between`"});
      }
    });
  }
};

/// A line that the surface is cut along, in one of four ways.
struct CutSpec {
  std::string name;
  std::vector<std::string> plane;
  std::array<double, 3> normal{0, 1, 0}, along{0, 0, 1};
  std::vector<std::string> path;
  std::string seam;
  std::vector<std::string> parts;
  bool dart = false;
  static void describe(auto& f) {
    f(&CutSpec::name, {.key = "name", .doc = "unique name; edges of the pieces are called by it", .required = true});
    f(&CutSpec::plane, {.key = "plane", .doc = "section by the plane through one point with `normal`, two points and the direction `along`, or three points; of several curves the one nearest to the first point"});
    f(&CutSpec::normal, {.key = "normal", .doc = "of the plane through one point"});
    f(&CutSpec::along, {.key = "along", .doc = "a direction in the plane through two points"});
    f(&CutSpec::path, {.key = "path", .doc = "or from point to point over the surface, each leg in the plane that stands on it"});
    f(&CutSpec::seam, {.key = "seam", .doc = "or a seam of the garment"});
    f(&CutSpec::parts, {.key = "parts", .doc = "regions or panels that a section is taken of"});
    f(&CutSpec::dart, {.key = "dart", .doc = "the path may end inside a piece; other ends that hang over are left off"});
    f.check([](const CutSpec& c, Issues& issues) {
      if (!c.plane.empty() + !c.path.empty() + !c.seam.empty() != 1) {
        issues.push_back({"bad_cut", {.item = "plane"}, fmt::format("it is not clear where the line '{}' runs", c.name), "give one of plane, path, seam"});
      } else if (c.plane.size() > 3 || (!c.path.empty() && c.path.size() < 2)) {
        issues.push_back({"bad_cut", {.item = c.path.empty() ? "plane" : "path"}, fmt::format("the number of points of the line '{}' does not fit", c.name), "a plane has one to three points, a path two or more"});
      }
    });
  }
};

/// A piece that is wanted; what no piece is asked for is left out.
struct PieceSpec {
  std::string at;
  std::array<double, 3> grain{0, 1, 0};
  std::string material;
  double allowance = 0;
  static void describe(auto& f) {
    f(&PieceSpec::at, {.key = "at", .doc = "a point inside it", .required = true});
    f(&PieceSpec::grain, {.key = "grain", .doc = "direction in space that the warp follows as well as it can"});
    f(&PieceSpec::material, {.key = "material", .doc = "what it is cut from"});
    f(&PieceSpec::allowance, {.key = "allowance", .doc = "seam allowance", .unit = "m", .min = 0, .max = 1});
    f.check([](const PieceSpec& p, Issues& issues) {
      if (p.grain[0] == 0 && p.grain[1] == 0 && p.grain[2] == 0) issues.push_back({"bad_piece", {.item = "grain"}, "the grain has no length", "give a direction, e.g. [0, 1, 0]"});
    });
  }
};

enum class Darts { none, propose, cut };

struct FlattenParams {
  std::string name = "flattened";
  std::map<std::string, PointSpec> points;
  std::vector<CutSpec> cuts;
  std::map<std::string, PieceSpec> pieces;
  double snap = 0.004;
  double fit = 2e-4;
  double limit = 0.03;
  Darts darts = Darts::propose;
  double dart_length = 0.2;
  double notch_every = 0.12;
  std::string seams, map;
  static void describe(auto& f) {
    f(&FlattenParams::name, {.key = "name", .doc = "name of the pattern"});
    f(&FlattenParams::points, {.key = "points", .doc = "further points, by name; they are taken to the surface"});
    f(&FlattenParams::cuts, {.key = "cuts", .doc = "lines that the surface is cut along, in this order"});
    f(&FlattenParams::pieces, {.key = "pieces", .doc = "pieces to lay flat, by name"});
    f(&FlattenParams::snap, {.key = "snap", .doc = "a point of a path nearer than this to a line that is cut already lies on it", .unit = "m", .min = 0, .max = 0.05});
    f(&FlattenParams::fit, {.key = "fit", .doc = "largest distance of a drawn curve from the flattened border", .unit = "m", .min = 1e-6, .max = 0.01});
    f(&FlattenParams::limit, {.key = "limit", .doc = "largest strain of a piece that asks for no dart", .unit = "1", .min = 1e-6, .max = 1});
    f(&FlattenParams::darts, {.key = "darts", .doc = "where a piece is over the limit: none, propose (report the best dart), cut (cut it)"});
    f(&FlattenParams::dart_length, {.key = "dart_length", .doc = "longest dart", .unit = "m", .min = 0.005, .max = 2});
    f(&FlattenParams::notch_every, {.key = "notch_every", .doc = "notches on edges that are sewn together, not farther apart than this; 0: none", .unit = "m", .min = 0, .max = 10});
    f(&FlattenParams::seams, {.key = "seams", .doc = "file that gets the seams as a spec for toile-sew; empty: none", .local = true});
    f(&FlattenParams::map, {.key = "map", .doc = "garment file with the pieces as panels, flat in (u, v) and on the surface in space; empty: none", .local = true});
    f.check([](const FlattenParams& p, Issues& issues) {
      for (std::size_t i = 0; i < p.cuts.size(); ++i) {
        for (std::size_t j = 0; j < i; ++j) {
          if (p.cuts[i].name == p.cuts[j].name) issues.push_back({"duplicate_name", {.item = fmt::format("cuts[{}]", i)}, fmt::format("there are two lines '{}'", p.cuts[i].name), "give each its own name"});
        }
      }
      if (p.pieces.empty()) issues.push_back({"no_pieces", {.item = "pieces"}, "no piece is asked for", "name at least one, with a point inside it"});
    });
  }
};

struct DartProposal {
  Eigen::Vector3d apex, mouth;  ///< on the surface [m]
  std::string edge;             ///< that it opens on
  double length = 0;            ///< [m]
  double intake = 0;            ///< how far its mouth opens [m]
  double rms_strain = 0, max_strain = 0;  ///< of the piece with it
};

struct PieceReport {
  std::string name;
  double area = 0;         ///< of the surface [m2]
  double area_change = 0;  ///< flat over curved, minus 1
  double max_strain = 0, rms_strain = 0;      ///< of the principal strains, absolute; weighted by area
  double most_stretch = 0, most_compression = 0;  ///< largest and smallest principal strain of the map to the plane
  int turned_faces = 0;
  int darts_cut = 0;
  std::optional<DartProposal> dart;
};

/// Two edges that were one line.
struct SeamRow {
  std::string name, kind = "plain";
  std::string a_piece, a_edge, b_piece, b_edge;
  double length_a = 0, length_b = 0;  ///< in the plane [m]
  std::vector<std::string> notches;   ///< of both edges, by the same name; within one piece the second has the suffix _b
};

struct Flattened {
  pattern::Pattern pattern;
  mesh::GarmentMesh map;  ///< the pieces as panels: uv in the pattern, x on the surface; sewn
  std::vector<PieceReport> pieces;
  std::vector<SeamRow> seams;
  Issues findings;  ///< "strain" and "turned_over" (check)
};

/// error  "unknown_point", "unknown_part", "unknown_seam", "no_section", "no_path", "loose_cut", "not_separated", "not_a_disk" (input)
Result<Flattened> flatten(const Surface& surface, const FlattenParams& params);
/// The same of a garment, whose seams may be lines.
Result<Flattened> flatten(const mesh::GarmentMesh& garment, const FlattenParams& params);

/// Seam spec for toile-sew (YAML).
std::string seam_spec(const std::vector<SeamRow>& seams);

/// Positions for the vertices of another mesh of the same panels (by name), through their panel coordinates.
/// ret    |V| x 3 [m]
/// error  "unknown_panel"
Result<Points3> positions_from(const mesh::GarmentMesh& map, const mesh::GarmentMesh& garment);

/// Bezier curves through a row of points, within `tolerance` of them; lines where they are straight; corners of more than 30
/// degrees stay. Source: docs/bibliography.md#schneider1990
std::vector<pattern::Segment> fit_curves(const std::vector<Eigen::Vector2d>& points, double tolerance);

}  // namespace toile::reshape

template <>
struct toile::Choices<toile::reshape::Darts> {
  static constexpr std::array names{std::pair{"none", toile::reshape::Darts::none}, std::pair{"propose", toile::reshape::Darts::propose},
                                    std::pair{"cut", toile::reshape::Darts::cut}};
};
