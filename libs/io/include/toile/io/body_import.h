// Bodies from other programs: OBJ, STL, PLY, glTF and whatever else assimp reads, checked and turned into a support.
#pragma once

#include "toile/base/fields.h"
#include "toile/base/result.h"
#include "toile/mesh/support_mesh.h"

#include <array>
#include <map>
#include <string>
#include <vector>

namespace toile::io {

enum class LengthUnit { m, cm, mm, in };
enum class Axis { x, y, z, minus_x, minus_y, minus_z };
enum class Winding {
  check,    ///< faces must look outward as they come
  outward,  ///< turn them so, piece by piece
};
enum class Pieces { all, largest };
enum class Standing { keep, floor };
enum class Segmentation {
  none,
  body,  ///< trunk, neck, arms and legs from sections
};

/// A named part of the surface. One of the four says which faces.
struct BodyRegion {
  std::string name;
  std::vector<double> box;  ///< [m], lowest x y z, highest x y z
  std::string part;
  std::string color;
  std::vector<std::string> landmarks;
  static void describe(auto& f) {
    f(&BodyRegion::name, {.key = "name", .doc = "such as torso, neck, arm_left; toile-place gives `offsets` by it", .required = true});
    f(&BodyRegion::box, {.key = "box", .doc = "faces whose middle lies between these corners: lowest x, y, z, highest x, y, z", .unit = "m"});
    f(&BodyRegion::part, {.key = "part", .doc = "faces of the file's object, group or material of that name"});
    f(&BodyRegion::color, {.key = "color", .doc = "faces painted so: two corners of the colour rrggbb, to within 2 of 255"});
    f(&BodyRegion::landmarks, {.key = "landmarks", .doc = "faces that no other way names and that are nearest, along the surface, to one of these landmarks"});
    f.check([](const BodyRegion& r, Issues& issues) {
      const int ways = int{!r.box.empty()} + int{!r.part.empty()} + int{!r.color.empty()} + int{!r.landmarks.empty()};
      if (ways != 1) {
        issues.push_back(Issue{"bad_combination", {.item = r.name}, fmt::format("{} of box, part, color and landmarks are given", ways), "give one of them"});
      }
      if (!r.box.empty() && (r.box.size() != 6 || r.box[0] >= r.box[3] || r.box[1] >= r.box[4] || r.box[2] >= r.box[5])) {
        issues.push_back(Issue{"bad_range", {.item = "box"}, "not a box", "give six numbers: the lowest x, y, z, then the highest"});
      }
      if (!r.color.empty() && (r.color.size() != 6 || r.color.find_first_not_of("0123456789abcdefABCDEF") != std::string::npos)) {
        issues.push_back(Issue{"bad_range", {.item = "color"}, "'" + r.color + "' is not a colour", "give six hexadecimal digits in quotes, such as 'ff8000'"});
      }
    });
  }
};

struct BodyImportParams {
  LengthUnit unit = LengthUnit::m;
  Axis up = Axis::y;
  Axis facing = Axis::z;
  Winding winding = Winding::check;
  Pieces pieces = Pieces::all;
  Standing standing = Standing::keep;
  double wrap = 0;
  double wrap_offset = 1e-3;
  double smallest_size = 0.3;
  double largest_size = 3.0;
  std::map<std::string, std::array<double, 3>> landmarks;
  double landmark_tolerance = 0.02;
  std::vector<BodyRegion> regions;
  Segmentation segment = Segmentation::none;  ///< what import_body leaves to its caller (placement/segment.h)

  static void describe(auto& f) {
    f(&BodyImportParams::unit, {.key = "unit", .doc = "unit of the file's coordinates; mesh files seldom say it themselves", .required = true});
    f(&BodyImportParams::up, {.key = "up", .doc = "the file's axis that points up"});
    f(&BodyImportParams::facing, {.key = "facing", .doc = "the file's axis that the body looks along"});
    f(&BodyImportParams::winding, {.key = "winding", .doc = "refuse faces that look inward, or turn them"});
    f(&BodyImportParams::pieces, {.key = "pieces", .doc = "keep every connected piece, or only the one of largest volume"});
    f(&BodyImportParams::standing, {.key = "standing", .doc = "keep the height, or move the lowest point to y = 0"});
    f(&BodyImportParams::wrap, {.key = "wrap", .doc = "draw a closed surface round the body that bridges holes, gaps and overlaps up to this width; 0: the body has to be closed itself", .unit = "m", .min = 0, .max = 10});
    f(&BodyImportParams::wrap_offset, {.key = "wrap_offset", .doc = "how far outside the body that surface lies", .unit = "m", .min = 1e-5, .max = 1});
    f(&BodyImportParams::smallest_size, {.key = "smallest_size", .doc = "the body's largest extent is at least this", .unit = "m", .min = 1e-6, .max = 1e4});
    f(&BodyImportParams::largest_size, {.key = "largest_size", .doc = "the body's largest extent is at most this", .unit = "m", .min = 1e-6, .max = 1e4});
    f(&BodyImportParams::landmarks, {.key = "landmarks", .doc = "named points x, y, z of the result (metres, y up, facing +z, after `standing`); each goes to the surface's nearest point", .unit = "m"});
    f(&BodyImportParams::landmark_tolerance, {.key = "landmark_tolerance", .doc = "a landmark farther from the surface than this is an error", .unit = "m", .min = 0, .max = 1});
    f(&BodyImportParams::regions, {.key = "regions", .doc = "named parts of the surface; where box, part and color name a face twice, the later region has it"});
    f(&BodyImportParams::segment, {.key = "segment", .doc = "body: faces without a region get one of torso, neck, arm_left, arm_right, leg_left, leg_right, from the body's sections"});
    f.check([](const BodyImportParams& p, Issues& issues) {
      if (static_cast<int>(p.up) % 3 == static_cast<int>(p.facing) % 3) {
        issues.push_back(Issue{"bad_axes", {.item = "facing"}, "up and facing lie along the same axis", "name two different axes"});
      }
      if (p.smallest_size > p.largest_size) {
        issues.push_back(Issue{"bad_range", {.item = "smallest_size"}, "smallest_size is above largest_size", "exchange them"});
      }
    });
  }
};

/// What a file says of its faces beside their place.
struct FaceMarks {
  std::vector<std::vector<std::string>> parts;  ///< names (object, group, mesh, material) that a face may bear
  std::vector<int> part;                        ///< of each face, index into parts; empty: none
  std::vector<int> color;                       ///< of each face, 0xrrggbb of at least two of its corners, or -1; empty: none
};

struct BodyPiece {
  int vertices = 0, faces = 0;
  double volume = 0;                  ///< signed [m3]
  std::array<double, 3> low{}, high{};  ///< [m]
};

struct ImportedBody {
  mesh::SupportMesh mesh;         ///< closed, outward, metres, y up, facing +z
  std::vector<BodyPiece> pieces;  ///< of the file, largest volume first
  int joined_corners = 0;       ///< corners and vertices of equal position that became one vertex
  int dropped_faces = 0;          ///< with a repeated vertex, after that
  int open_edges = 0;             ///< of the file, if a wrap was asked for: edges with a face on one side only
  double wrap_distance = 0;       ///< largest distance of the wrap's vertices from the file's surface [m]
};

/// Reads a mesh file. Vertices of exactly equal position are one vertex.
/// error  Issue "cannot_read" (not there, not a mesh, no faces), "implausible_size", "open_surface", "not_manifold",
///        "inside_out", "wrap_enters" (a hole wider than params.wrap, so that the wrap lines the inside), "off_surface" (a landmark), "unknown_landmark", "empty_region", each
///        with counts and places; no guess is made on unit or axes
Result<ImportedBody> import_body(const std::string& path, const BodyImportParams& params);

/// The same from triangles in the file's own coordinates (one row of x a corner or a vertex).
/// marks  of the faces, for regions by part and color
Result<ImportedBody> import_body(mesh::Points3 x, mesh::Triangles faces, const std::string& name, const BodyImportParams& params, const FaceMarks& marks = {});

}  // namespace toile::io

template <>
struct toile::Choices<toile::io::LengthUnit> {
  using E = toile::io::LengthUnit;
  static constexpr std::array names{std::pair{"m", E::m}, std::pair{"cm", E::cm}, std::pair{"mm", E::mm}, std::pair{"in", E::in}};
};
template <>
struct toile::Choices<toile::io::Axis> {
  using E = toile::io::Axis;
  static constexpr std::array names{std::pair{"x", E::x},        std::pair{"y", E::y},        std::pair{"z", E::z},
                                    std::pair{"-x", E::minus_x}, std::pair{"-y", E::minus_y}, std::pair{"-z", E::minus_z}};
};
template <>
struct toile::Choices<toile::io::Winding> {
  using E = toile::io::Winding;
  static constexpr std::array names{std::pair{"check", E::check}, std::pair{"outward", E::outward}};
};
template <>
struct toile::Choices<toile::io::Pieces> {
  using E = toile::io::Pieces;
  static constexpr std::array names{std::pair{"all", E::all}, std::pair{"largest", E::largest}};
};
template <>
struct toile::Choices<toile::io::Standing> {
  using E = toile::io::Standing;
  static constexpr std::array names{std::pair{"keep", E::keep}, std::pair{"floor", E::floor}};
};
template <>
struct toile::Choices<toile::io::Segmentation> {
  using E = toile::io::Segmentation;
  static constexpr std::array names{std::pair{"none", E::none}, std::pair{"body", E::body}};
};
