#include <Eigen/Geometry>
#include <cmath>

#include "export_common.h"
#include "toile/base/text.h"
#include "toile/io/export.h"

namespace toile::io {
namespace {

template <class Row>
void add_row(std::string& out, const char* key, const Row& row) {
  out += key;
  for (Eigen::Index k = 0; k < row.size(); ++k) {
    out += ' ';
    out += format_number(row[k]);
  }
  out += '\n';
}

/// Six digits are more than shading can use, and the same on every processor.
void add_normals(std::string& out, const mesh::Points3& normals) {
  for (Eigen::Index v = 0; v < normals.rows(); ++v) {
    out += "vn";
    for (int k = 0; k < 3; ++k) out += fmt::format(" {:.6g}", std::abs(normals(v, k)) < 5e-7 ? 0.0 : normals(v, k));
    out += '\n';
  }
}

}  // namespace

mesh::Points3 export_normals(const mesh::Points3& x, const mesh::Triangles& faces) {
  mesh::Points3 normals = mesh::Points3::Zero(x.rows(), 3);
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d p = x.row(faces(f, k)), d = x.row(faces(f, (k + 1) % 3)).transpose() - p, e = x.row(faces(f, (k + 2) % 3)).transpose() - p;
      const Eigen::Vector3d c = d.cross(e);
      const double size = c.norm();
      if (size > 0) normals.row(faces(f, k)) += std::atan2(size, d.dot(e)) / size * c.transpose();
    }
  }
  for (Eigen::Index v = 0; v < x.rows(); ++v) {
    const double size = normals.row(v).norm();
    // A point without a surface still needs a unit normal to be valid.
    if (size > 0) normals.row(v) /= size;
    else normals.row(v) << 0, 1, 0;
  }
  return normals;
}

std::string one_word(const std::string& name) {
  std::string word = name;
  for (char& c : word) {
    if (static_cast<unsigned char>(c) <= ' ') c = '_';
  }
  return word.empty() ? "unnamed" : word;
}

std::string format_obj(const mesh::GarmentMesh& g, SeamPoints seams) {
  std::string out = "# Toile garment; metres, y up; vt: panel coordinates in metres, v along the warp\n";
  const bool merged = seams == SeamPoints::merged;
  const mesh::Ids particle = mesh::particles(g);
  mesh::Points3 x = g.x;
  mesh::Triangles faces = g.faces;
  if (merged) {
    const int n = particle.size() > 0 ? particle.maxCoeff() + 1 : 0;
    x = mesh::Points3::Zero(n, 3);
    Eigen::VectorXd count = Eigen::VectorXd::Zero(n);
    for (Eigen::Index v = 0; v < g.vertex_count(); ++v) {
      x.row(particle[v]) += g.x.row(v);
      count[particle[v]] += 1;
    }
    for (int p = 0; p < n; ++p) x.row(p) /= count[p];
    for (Eigen::Index i = 0; i < faces.size(); ++i) faces.data()[i] = particle[faces.data()[i]];
  }
  const mesh::Points3 normals = export_normals(x, faces);
  for (Eigen::Index v = 0; v < x.rows(); ++v) add_row(out, "v", x.row(v));
  for (Eigen::Index v = 0; v < g.vertex_count(); ++v) add_row(out, "vt", g.uv.row(v));
  add_normals(out, normals);
  for (const mesh::Panel& panel : g.panels) {
    out += "g " + one_word(panel.name) + '\n';
    for (Eigen::Index f = 0; f < g.face_count(); ++f) {
      if (g.face_panel[f] != panel.id) continue;
      out += 'f';
      for (int k = 0; k < 3; ++k) out += fmt::format(" {}/{}/{}", faces(f, k) + 1, g.faces(f, k) + 1, faces(f, k) + 1);
      out += '\n';
    }
  }
  return out;
}

std::string format_obj(const mesh::SupportMesh& s) {
  std::string out = "# Toile support; metres, y up\n";
  const mesh::Points3 normals = export_normals(s.x, s.faces);
  for (Eigen::Index v = 0; v < s.x.rows(); ++v) add_row(out, "v", s.x.row(v));
  add_normals(out, normals);
  for (int region = -1; region < static_cast<int>(s.region_names.size()); ++region) {
    bool titled = false;
    for (Eigen::Index f = 0; f < s.faces.rows(); ++f) {
      if (s.face_region[f] != region) continue;
      if (!titled) out += "g " + (region < 0 ? std::string("body") : one_word(s.region_names[static_cast<std::size_t>(region)])) + '\n';
      titled = true;
      out += 'f';
      for (int k = 0; k < 3; ++k) out += fmt::format(" {}//{}", s.faces(f, k) + 1, s.faces(f, k) + 1);
      out += '\n';
    }
  }
  return out;
}

}  // namespace toile::io
