// Garments and supports for other programs: Wavefront OBJ, glTF 2.0, VTK XML polygons. docs/export.md.
#pragma once

#include "toile/base/fields.h"
#include "toile/io/frames.h"
#include "toile/mesh/garment_mesh.h"
#include "toile/mesh/support_mesh.h"

#include <string>

namespace toile::io {

enum class SeamPoints {
  separate,  ///< each panel keeps its own border points
  merged,    ///< sewn points are one point (OBJ only: its texture coordinates have their own indices)
};

/// One group a panel; `v` positions, `vt` panel coordinates [m] (u along the weft, v along the warp), `vn` normals. A support
/// has one group a region and no `vt`.
std::string format_obj(const mesh::GarmentMesh& garment, SeamPoints seams);
std::string format_obj(const mesh::SupportMesh& support);

/// One node a panel, one material a laminate with its card's colour, both sides visible. TEXCOORD_0 is (u, 1 - v) in metres: a
/// texture that repeats every metre lies on the cloth as it was cut.
/// glb: the binary container; else JSON with the buffer inside as base64.
enum class GltfContainer { json, binary };
std::string format_gltf(const mesh::GarmentMesh& garment, GltfContainer container);
std::string format_gltf(const mesh::SupportMesh& support, GltfContainer container);

/// Frames as morph targets with one animation; normals stay those of the mesh. Both sequences have the same times.
struct Animation {
  const FrameSequence* garment = nullptr;
  const FrameSequence* support = nullptr;
};
/// Precondition: frames have as many points as the mesh that they move.
std::string format_gltf(const mesh::GarmentMesh& garment, const mesh::SupportMesh* support, const Animation& animation, GltfContainer container);

/// All columns as arrays: points with u, v, panel, particle and further vertex columns, polygons with panel, laminate and
/// further face columns. Raw appended doubles and 32-bit integers, little-endian; or ascii.
enum class VtpEncoding { raw, ascii };
std::string format_vtp(const mesh::GarmentMesh& garment, VtpEncoding encoding);
std::string format_vtp(const mesh::SupportMesh& support, VtpEncoding encoding);

}  // namespace toile::io
