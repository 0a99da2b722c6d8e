#include "tree.h"

#include <numeric>

namespace toile::contact {

Tree::Tree(const Surface& surface, const Points3& x) {
  const int face_count = static_cast<int>(surface.faces.rows());
  face_id.resize(face_count);
  std::iota(face_id.begin(), face_id.end(), 0);
  std::vector<Vec> centre(face_count);
  for (int f = 0; f < face_count; ++f) {
    const auto& t = surface.faces.row(f);
    centre[f] = (x.row(t[0]) + x.row(t[1]) + x.row(t[2])).transpose() / 3;
  }
  // Split at the median along the longest side, the lower half rounded up to whole leaves so that leaves are full.
  struct Range {
    int node, first, last;
  };
  std::vector<Range> open;
  if (face_count > 0) {
    nodes.push_back({0, 0});
    open.push_back({0, 0, face_count});
  }
  leaf_face.push_back(0);
  while (!open.empty()) {
    const Range r = open.back();
    open.pop_back();
    const int count = r.last - r.first;
    if (count <= leaf_faces) {
      // The left child is worked off first, so leaves come in order of faces.
      nodes[r.node].left = ~static_cast<int>(leaf_node.size());
      leaf_node.push_back(r.node);
      leaf_face.push_back(r.last);
      continue;
    }
    Vec lo = Vec::Constant(INFINITY), hi = Vec::Constant(-INFINITY);
    for (int i = r.first; i < r.last; ++i) lo = lo.cwiseMin(centre[face_id[i]]), hi = hi.cwiseMax(centre[face_id[i]]);
    int axis;
    (hi - lo).maxCoeff(&axis);
    const int leaves = (count + leaf_faces - 1) / leaf_faces;
    const int middle = r.first + (leaves / 2) * leaf_faces;
    std::nth_element(face_id.begin() + r.first, face_id.begin() + middle, face_id.begin() + r.last, [&](int p, int q) {
      return centre[p][axis] != centre[q][axis] ? centre[p][axis] < centre[q][axis] : p < q;
    });
    const int left = static_cast<int>(nodes.size());
    nodes[r.node].left = left;
    nodes.push_back({0, 0});
    nodes.push_back({0, 0});
    open.push_back({left + 1, middle, r.last});
    open.push_back({left, r.first, middle});
  }
  for (int leaf = 0; leaf < leaf_count(); ++leaf) {
    std::sort(face_id.begin() + leaf_face[leaf], face_id.begin() + leaf_face[leaf + 1]);
  }
  for (int i = static_cast<int>(nodes.size()) - 1; i >= 0; --i) {
    nodes[i].last_leaf = nodes[i].left < 0 ? ~nodes[i].left : nodes[nodes[i].left + 1].last_leaf;
  }

  std::vector<int> local_vertex(surface.node_count, -1), local_edge(surface.edges.size(), -1);
  for (int leaf = 0; leaf < leaf_count(); ++leaf) {
    leaf_vertex.push_back(static_cast<int>(vertex_id.size()));
    leaf_edge.push_back(static_cast<int>(edge_id.size()));
    for (int i = leaf_face[leaf]; i < leaf_face[leaf + 1]; ++i) {
      const int f = face_id[i];
      for (int k = 0; k < 3; ++k) {
        const int v = surface.faces(f, k), e = surface.face_edges[f][k];
        if (local_vertex[v] < 0) {
          local_vertex[v] = static_cast<int>(vertex_id.size());
          vertex_id.push_back(v);
        }
        if (local_edge[e] < 0) {
          local_edge[e] = static_cast<int>(edge_id.size());
          edge_id.push_back(e);
        }
      }
    }
  }
  leaf_vertex.push_back(static_cast<int>(vertex_id.size()));
  leaf_edge.push_back(static_cast<int>(edge_id.size()));

  for (const int f : face_id) {
    face.push_back({local_vertex[surface.faces(f, 0)], local_vertex[surface.faces(f, 1)], local_vertex[surface.faces(f, 2)]});
  }
  for (const int e : edge_id) {
    const auto& [a, b] = surface.edges[e];
    edge.push_back({local_vertex[a], local_vertex[b]});
    std::array<int, 2> third{-1, -1};
    for (int side = 0; side < 2; ++side) {
      const int f = surface.edge_faces[e][side];
      if (f < 0) continue;
      for (int k = 0; k < 3; ++k) {
        const int v = surface.faces(f, k);
        if (v != a && v != b) third[side] = local_vertex[v];
      }
    }
    edge_third.push_back(third);
  }
  for (const int v : vertex_id) adjacency.push_back(surface.adjacency[v]);
  for (const auto& e : edge) edge_adjacency.push_back({adjacency[e[0]], adjacency[e[1]]});
  for (const auto& f : face) face_adjacency.push_back({adjacency[f[0]], adjacency[f[1]], adjacency[f[2]]});
}

void Boxes::refit(const Tree& tree, const std::vector<Vec>& x0, const std::vector<Vec>& x1, double grow) {
  vertex.resize(tree.vertex_id.size());
  edge.resize(tree.edge.size());
  face.resize(tree.face.size());
  node.resize(tree.nodes.size());
  parallel_for(vertex.size(), 2048, [&](std::size_t i) { vertex[i] = point_box(x0[i], x1[i], grow); });
  parallel_for(tree.leaf_count(), 256, [&](std::size_t leaf) {
    for (int i = tree.leaf_edge[leaf]; i < tree.leaf_edge[leaf + 1]; ++i) {
      edge[i] = merged(vertex[tree.edge[i][0]], vertex[tree.edge[i][1]]);
    }
    Box all = empty_box();
    for (int i = tree.leaf_face[leaf]; i < tree.leaf_face[leaf + 1]; ++i) {
      const auto& t = tree.face[i];
      face[i] = merged(merged(vertex[t[0]], vertex[t[1]]), vertex[t[2]]);
      all = merged(all, face[i]);
    }
    node[tree.leaf_node[leaf]] = all;
  });
  for (int i = static_cast<int>(tree.nodes.size()) - 1; i >= 0; --i) {
    const int left = tree.nodes[i].left;
    if (left >= 0) node[i] = merged(node[left], node[left + 1]);
  }
}

}  // namespace toile::contact
