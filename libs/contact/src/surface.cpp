#include "toile/contact/surface.h"

#include "toile/base/result.h"

#include <algorithm>
#include <tuple>

namespace toile::contact {

Surface make_surface(int node_count, const Triangles& faces, const Ids& adjacency) {
  TOILE_CHECK(adjacency.size() == 0 || adjacency.size() == node_count, "adjacency {} nodes {}", adjacency.size(), node_count);
  Surface s;
  s.node_count = node_count;
  s.faces = faces;
  s.adjacency = adjacency.size() ? adjacency : Ids(Ids::LinSpaced(node_count, 0, node_count - 1));
  const int face_count = static_cast<int>(faces.rows());

  struct Side {
    int a, b, face, corner;
  };
  std::vector<Side> sides;
  sides.reserve(3 * face_count);
  std::vector<char> used(node_count, 0);
  for (int f = 0; f < face_count; ++f) {
    for (int k = 0; k < 3; ++k) {
      const int a = faces(f, k), b = faces(f, (k + 1) % 3);
      TOILE_CHECK(a >= 0 && a < node_count && a != b, "face {} corners {} {} nodes {}", f, a, b, node_count);
      used[a] = 1;
      sides.push_back({std::min(a, b), std::max(a, b), f, k});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const Side& p, const Side& q) {
    return std::tie(p.a, p.b, p.face, p.corner) < std::tie(q.a, q.b, q.face, q.corner);
  });
  s.face_edges.resize(face_count);
  for (std::size_t i = 0; i < sides.size(); ++i) {
    const Side& side = sides[i];
    if (i == 0 || side.a != sides[i - 1].a || side.b != sides[i - 1].b) {
      s.edges.push_back({side.a, side.b});
      s.edge_faces.push_back({side.face, -1});
    } else if (s.edge_faces.back()[1] < 0) {
      s.edge_faces.back()[1] = side.face;
    }
    s.face_edges[side.face][side.corner] = static_cast<int>(s.edges.size()) - 1;
  }
  for (int v = 0; v < node_count; ++v) {
    if (used[v]) s.vertices.push_back(v);
  }
  return s;
}

}  // namespace toile::contact
