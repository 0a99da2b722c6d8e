// A surface in the order of its bounding box tree: leaves of a few neighbouring faces, flat arrays, boxes in float
// rounded outwards. Each vertex and edge is owned by one leaf, so that a pair of leaves tests each pair of primitives once.
#pragma once

#include "toile/base/parallel.h"
#include "toile/contact/distance.h"
#include "toile/contact/surface.h"

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace toile::contact {

#if defined(__SSE2__)
struct Box {
  __m128 lo, hi;  ///< x y z 0
};
inline Box empty_box() { return {_mm_setr_ps(INFINITY, INFINITY, INFINITY, 0), _mm_setr_ps(-INFINITY, -INFINITY, -INFINITY, 0)}; }
inline Box merged(const Box& a, const Box& b) { return {_mm_min_ps(a.lo, b.lo), _mm_max_ps(a.hi, b.hi)}; }
inline Box common(const Box& a, const Box& b) { return {_mm_max_ps(a.lo, b.lo), _mm_min_ps(a.hi, b.hi)}; }
inline bool overlap(const Box& a, const Box& b) {
  return _mm_movemask_ps(_mm_and_ps(_mm_cmple_ps(a.lo, b.hi), _mm_cmple_ps(b.lo, a.hi))) == 15;
}
inline Box make_box(const float* lo, const float* hi) { return {_mm_setr_ps(lo[0], lo[1], lo[2], 0), _mm_setr_ps(hi[0], hi[1], hi[2], 0)}; }
#else
struct Box {
  float lo[3], hi[3];
};
inline Box empty_box() { return {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}}; }
inline Box merged(const Box& a, const Box& b) {
  Box r;
  for (int k = 0; k < 3; ++k) r.lo[k] = std::min(a.lo[k], b.lo[k]), r.hi[k] = std::max(a.hi[k], b.hi[k]);
  return r;
}
inline Box common(const Box& a, const Box& b) {
  Box r;
  for (int k = 0; k < 3; ++k) r.lo[k] = std::max(a.lo[k], b.lo[k]), r.hi[k] = std::min(a.hi[k], b.hi[k]);
  return r;
}
inline bool overlap(const Box& a, const Box& b) {
  return a.lo[0] <= b.hi[0] && b.lo[0] <= a.hi[0] && a.lo[1] <= b.hi[1] && b.lo[1] <= a.hi[1] && a.lo[2] <= b.hi[2] && b.lo[2] <= a.hi[2];
}
inline Box make_box(const float* lo, const float* hi) { return {{lo[0], lo[1], lo[2]}, {hi[0], hi[1], hi[2]}}; }
#endif

/// Box of the points p and q, grown by `grow`, rounded outwards.
inline Box point_box(const Vec& p, const Vec& q, double grow) {
  float lo[3], hi[3];
  for (int k = 0; k < 3; ++k) {
    const double l = std::min(p[k], q[k]) - grow, h = std::max(p[k], q[k]) + grow;
    lo[k] = static_cast<float>(l - 1e-7 * std::abs(l) - 1e-30);
    hi[k] = static_cast<float>(h + 1e-7 * std::abs(h) + 1e-30);
  }
  return make_box(lo, hi);
}

/// Topology of a surface in tree order. "Local" ids count in that order.
struct Tree {
  Tree() = default;
  Tree(const Surface& surface, const Points3& x);

  int leaf_count() const { return static_cast<int>(leaf_face.size()) - 1; }

  std::vector<int> vertex_id, edge_id, face_id;  ///< local -> surface
  std::vector<std::array<int, 2>> edge;          ///< local vertices, in the order of the surface's edge
  std::vector<std::array<int, 3>> face;          ///< local vertices, in the order of the surface's face
  std::vector<std::array<int, 2>> edge_third;    ///< local third corners of an edge's faces, -1 where there is none
  std::vector<int> adjacency;                    ///< of local vertices
  std::vector<int> leaf_vertex, leaf_edge, leaf_face;  ///< first owned primitive of each leaf, and an end mark

  struct Node {
    int left;        ///< first child (the second follows it), or ~leaf
    int last_leaf;   ///< highest leaf below
  };
  std::vector<Node> nodes;  ///< parents before children; node 0 is the root
  std::vector<int> leaf_node;
};

/// Most faces of a leaf, and so a bound for what it owns.
constexpr int leaf_faces = 4;

/// Boxes of everything in a tree for one state or motion.
struct Boxes {
  std::vector<Box> vertex, edge, face, node;

  /// Boxes of the motion x0 -> x1 (the same array for a state), grown by `grow`.
  void refit(const Tree& tree, const std::vector<Vec>& x0, const std::vector<Vec>& x1, double grow);
};

/// Calls body(leaf of other) for each leaf whose box overlaps `box`; leaves below `first_leaf` are left out.
template <class Body>
void for_each_leaf(const Tree& tree, const Boxes& boxes, const Box& box, int first_leaf, const Body& body) {
  if (tree.nodes.empty()) return;
  int stack[64];
  int top = 0;
  stack[top++] = 0;
  while (top > 0) {
    const int i = stack[--top];
    const Tree::Node& node = tree.nodes[i];
    if (node.last_leaf < first_leaf || !overlap(boxes.node[i], box)) continue;
    if (node.left < 0) {
      body(~node.left);
    } else {
      stack[top++] = node.left + 1;
      stack[top++] = node.left;
    }
  }
}

/// Owned primitives of a leaf whose boxes reach into `box`.
struct Reaching {
  int vertex[3 * leaf_faces], edge[3 * leaf_faces], face[leaf_faces];
  int vertices = 0, edges = 0, faces = 0;
};
inline Reaching reaching(const Tree& tree, const Boxes& boxes, int leaf, const Box& box) {
  Reaching r;
  for (int i = tree.leaf_vertex[leaf]; i < tree.leaf_vertex[leaf + 1]; ++i) {
    if (overlap(boxes.vertex[i], box)) r.vertex[r.vertices++] = i;
  }
  for (int i = tree.leaf_edge[leaf]; i < tree.leaf_edge[leaf + 1]; ++i) {
    if (overlap(boxes.edge[i], box)) r.edge[r.edges++] = i;
  }
  for (int i = tree.leaf_face[leaf]; i < tree.leaf_face[leaf + 1]; ++i) {
    if (overlap(boxes.face[i], box)) r.face[r.faces++] = i;
  }
  return r;
}

/// Pairs of primitives with overlapping boxes between leaf `a` of one tree and `b` of another (or the same):
/// vertex_face(vertex of a, face of b), face_vertex(face of a, vertex of b), edge_edge(edge of a, edge of b).
template <class VertexFace, class FaceVertex, class EdgeEdge>
void for_each_pair(const Tree& ta, const Boxes& ba, int a, const Tree& tb, const Boxes& bb, int b, const VertexFace& vertex_face,
                   const FaceVertex& face_vertex, const EdgeEdge& edge_edge) {
  const Box both = common(ba.node[ta.leaf_node[a]], bb.node[tb.leaf_node[b]]);
  const Reaching ra = reaching(ta, ba, a, both), rb = reaching(tb, bb, b, both);
  for (int i = 0; i < ra.vertices; ++i) {
    for (int j = 0; j < rb.faces; ++j) {
      if (overlap(ba.vertex[ra.vertex[i]], bb.face[rb.face[j]])) vertex_face(ra.vertex[i], rb.face[j]);
    }
  }
  for (int i = 0; i < ra.faces; ++i) {
    for (int j = 0; j < rb.vertices; ++j) {
      if (overlap(ba.face[ra.face[i]], bb.vertex[rb.vertex[j]])) face_vertex(ra.face[i], rb.vertex[j]);
    }
  }
  for (int i = 0; i < ra.edges; ++i) {
    for (int j = 0; j < rb.edges; ++j) {
      if (overlap(ba.edge[ra.edge[i]], bb.edge[rb.edge[j]])) edge_edge(ra.edge[i], rb.edge[j]);
    }
  }
}

/// The same within one leaf; every unordered pair once.
template <class VertexFace, class EdgeEdge>
void for_each_pair_within(const Tree& tree, const Boxes& boxes, int leaf, const VertexFace& vertex_face, const EdgeEdge& edge_edge) {
  for (int i = tree.leaf_vertex[leaf]; i < tree.leaf_vertex[leaf + 1]; ++i) {
    for (int j = tree.leaf_face[leaf]; j < tree.leaf_face[leaf + 1]; ++j) {
      if (overlap(boxes.vertex[i], boxes.face[j])) vertex_face(i, j);
    }
  }
  for (int i = tree.leaf_edge[leaf]; i < tree.leaf_edge[leaf + 1]; ++i) {
    for (int j = i + 1; j < tree.leaf_edge[leaf + 1]; ++j) {
      if (overlap(boxes.edge[i], boxes.edge[j])) edge_edge(i, j);
    }
  }
}

}  // namespace toile::contact
