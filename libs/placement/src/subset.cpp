#include "toile/placement/subset.h"

#include "toile/mesh/remove_panels.h"

namespace toile::placement {

Points3 Subset::restricted(const Points3& whole) const {
  Points3 x(static_cast<Eigen::Index>(vertex_of.size()), 3);
  for (std::size_t i = 0; i < vertex_of.size(); ++i) x.row(static_cast<Eigen::Index>(i)) = whole.row(vertex_of[i]);
  return x;
}

std::vector<double> Subset::restricted(const std::vector<double>& whole) const {
  std::vector<double> values;
  if (whole.empty()) return values;
  for (const int v : vertex_of) values.push_back(whole[static_cast<std::size_t>(v)]);
  return values;
}

Points3 Subset::merged(const Points3& subset, const Points3& whole) const {
  Points3 x = whole;
  for (std::size_t i = 0; i < vertex_of.size(); ++i) x.row(vertex_of[i]) = subset.row(static_cast<Eigen::Index>(i));
  return x;
}

Subset take_apart(const mesh::GarmentMesh& garment, const std::vector<char>& keep) {
  Subset subset;
  std::vector<char> removed;
  for (const char k : keep) removed.push_back(!k);
  subset.mesh = mesh::without_panels(garment, removed);
  for (Eigen::Index v = 0; v < garment.vertex_count(); ++v) {
    if (keep[static_cast<std::size_t>(garment.vertex_panel[v])]) subset.vertex_of.push_back(static_cast<int>(v));
  }
  return subset;
}

Subset take(const mesh::GarmentMesh& garment, const std::vector<char>& keep) {
  Subset subset;
  mesh::GarmentMesh& m = subset.mesh;
  std::vector<int> number(static_cast<std::size_t>(garment.vertex_count()), -1);
  for (Eigen::Index v = 0; v < garment.vertex_count(); ++v) {
    if (!keep[static_cast<std::size_t>(garment.vertex_panel[v])]) continue;
    number[static_cast<std::size_t>(v)] = static_cast<int>(subset.vertex_of.size());
    subset.vertex_of.push_back(static_cast<int>(v));
  }
  const auto to = [&](int v) { return number[static_cast<std::size_t>(v)]; };
  const auto count = static_cast<Eigen::Index>(subset.vertex_of.size());
  m.x.resize(count, 3);
  m.uv.resize(count, 2);
  m.vertex_panel.resize(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const int v = subset.vertex_of[static_cast<std::size_t>(i)];
    m.x.row(i) = garment.x.row(v);
    m.uv.row(i) = garment.uv.row(v);
    m.vertex_panel[i] = garment.vertex_panel[v];
  }
  Eigen::Index faces = 0;
  for (Eigen::Index f = 0; f < garment.face_count(); ++f) faces += keep[static_cast<std::size_t>(garment.face_panel[f])] != 0;
  m.faces.resize(faces, 3);
  m.face_panel.resize(faces);
  m.face_laminate.resize(faces);
  Eigen::Index row = 0;
  for (Eigen::Index f = 0; f < garment.face_count(); ++f) {
    if (!keep[static_cast<std::size_t>(garment.face_panel[f])]) continue;
    for (int k = 0; k < 3; ++k) m.faces(row, k) = to(garment.faces(f, k));
    m.face_panel[row] = garment.face_panel[f];
    m.face_laminate[row] = garment.face_laminate[f];
    ++row;
  }
  m.panels = garment.panels;
  m.seams = garment.seams;
  m.folds = garment.folds;
  for (mesh::Fold& fold : m.folds) fold.runs.clear();
  for (const mesh::Weld& weld : garment.welds) {
    if (to(weld.a) >= 0 && to(weld.b) >= 0) m.welds.push_back({to(weld.a), to(weld.b), weld.seam});
  }
  for (mesh::Hinge hinge : garment.hinges) {
    if (to(hinge.v0) < 0 || to(hinge.v1) < 0 || to(hinge.o0) < 0 || to(hinge.o1) < 0) continue;
    for (int* v : {&hinge.v0, &hinge.v1, &hinge.o0, &hinge.o1}) *v = to(*v);
    m.hinges.push_back(hinge);
  }
  for (mesh::Fastener fastener : garment.fasteners) {
    if (to(fastener.a) < 0 || to(fastener.b) < 0) continue;
    fastener.a = to(fastener.a);
    fastener.b = to(fastener.b);
    m.fasteners.push_back(fastener);
  }
  return subset;
}

}  // namespace toile::placement
