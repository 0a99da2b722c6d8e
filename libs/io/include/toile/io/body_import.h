// Bodies from other programs: OBJ, STL, PLY, glTF and whatever else assimp reads, checked and turned into a support.
#pragma once

#include "toile/base/fields.h"
#include "toile/base/result.h"
#include "toile/mesh/support_mesh.h"

#include <array>
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
///        "inside_out", "wrap_enters" (a hole wider than params.wrap, so that the wrap lines the inside), each with counts and places; no guess is made on unit or axes
Result<ImportedBody> import_body(const std::string& path, const BodyImportParams& params);

/// The same from triangles in the file's own coordinates (one row of x a corner or a vertex).
Result<ImportedBody> import_body(mesh::Points3 x, mesh::Triangles faces, const std::string& name, const BodyImportParams& params);

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
