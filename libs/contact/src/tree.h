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
inline bool contains(const Box& outer, const Box& inner) {
  return _mm_movemask_ps(_mm_and_ps(_mm_cmple_ps(outer.lo, inner.lo), _mm_cmple_ps(inner.hi, outer.hi))) == 15;
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
inline bool contains(const Box& outer, const Box& inner) {
  return outer.lo[0] <= inner.lo[0] && inner.hi[0] <= outer.hi[0] && outer.lo[1] <= inner.lo[1] && inner.hi[1] <= outer.hi[1] && outer.lo[2] <= inner.lo[2] && inner.hi[2] <= outer.hi[2];
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
  std::vector<int> adjacency;                    ///< id of local vertices; primitives that share one are neighbours
  std::vector<std::array<int, 2>> edge_adjacency;
  std::vector<std::array<int, 3>> face_adjacency;
  std::vector<int> leaf_vertex, leaf_edge, leaf_face;  ///< first owned primitive of each leaf, and an end mark

  struct Node {
    int left;        ///< first child (the second follows it), or ~leaf
    int last_leaf;   ///< highest leaf below
  };
  std::vector<Node> nodes;  ///< parents before children; node 0 is the root
  std::vector<int> leaf_node;
};

/// Most faces of a leaf, and so a bound for what it owns.
constexpr int leaf_faces = 6;

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

/// Pairs of local primitive ids, filled without branches: whether two boxes overlap is hard to foretell for a processor.
template <int capacity>
struct PairList {
  std::array<int, 2> pair[capacity + 1];
  int size = 0;
  void add_if(bool condition, int a, int b) {
    pair[size] = {a, b};
    size += condition;
  }
};

/// Most vertices or edges that a leaf owns.
constexpr int leaf_primitives = 3 * leaf_faces;

/// Pairs of primitives with overlapping boxes of two leaves; neighbours are left out.
struct LeafPairs {
  PairList<leaf_primitives * leaf_faces> vertex_face;  ///< vertex of the first leaf, face of the second
  PairList<leaf_primitives * leaf_faces> face_vertex;  ///< face of the first, vertex of the second
  PairList<leaf_primitives * leaf_primitives> edge_edge;
};

/// Owned primitives of a leaf whose boxes reach into `box`.
struct Reaching {
  int vertex[leaf_primitives + 1], edge[leaf_primitives + 1], face[leaf_faces + 1];
  int vertices = 0, edges = 0, faces = 0;
  Reaching(const Tree& tree, const Boxes& boxes, int leaf, const Box& box) {
    for (int i = tree.leaf_vertex[leaf]; i < tree.leaf_vertex[leaf + 1]; ++i) {
      vertex[vertices] = i;
      vertices += overlap(boxes.vertex[i], box);
    }
    for (int i = tree.leaf_edge[leaf]; i < tree.leaf_edge[leaf + 1]; ++i) {
      edge[edges] = i;
      edges += overlap(boxes.edge[i], box);
    }
    for (int i = tree.leaf_face[leaf]; i < tree.leaf_face[leaf + 1]; ++i) {
      face[faces] = i;
      faces += overlap(boxes.face[i], box);
    }
  }
};

/// Local ids of primitives, as adjacency ids.
inline bool neighbours(int vertex, const std::array<int, 3>& face) { return (vertex == face[0]) | (vertex == face[1]) | (vertex == face[2]); }
inline bool neighbours(const std::array<int, 2>& e, const std::array<int, 2>& f) {
  return (e[0] == f[0]) | (e[0] == f[1]) | (e[1] == f[0]) | (e[1] == f[1]);
}

enum class Between { one_surface, two_surfaces };

/// Fills `out` with the pairs of leaf `a` of one tree and leaf `b` of another (or another leaf of the same).
template <Between between>
void collect_pairs(const Tree& ta, const Boxes& ba, int a, const Tree& tb, const Boxes& bb, int b, LeafPairs& out) {
  out.vertex_face.size = out.face_vertex.size = out.edge_edge.size = 0;
  const Box both = common(ba.node[ta.leaf_node[a]], bb.node[tb.leaf_node[b]]);
  const Reaching ra(ta, ba, a, both), rb(tb, bb, b, both);
  constexpr bool one = between == Between::one_surface;
  for (int i = 0; i < ra.vertices; ++i) {
    const int v = ra.vertex[i];
    for (int j = 0; j < rb.faces; ++j) {
      const int f = rb.face[j];
      bool hit = overlap(ba.vertex[v], bb.face[f]);
      if constexpr (one) hit &= !neighbours(ta.adjacency[v], tb.face_adjacency[f]);
      out.vertex_face.add_if(hit, v, f);
    }
  }
  for (int i = 0; i < ra.faces; ++i) {
    const int f = ra.face[i];
    for (int j = 0; j < rb.vertices; ++j) {
      const int v = rb.vertex[j];
      bool hit = overlap(ba.face[f], bb.vertex[v]);
      if constexpr (one) hit &= !neighbours(tb.adjacency[v], ta.face_adjacency[f]);
      out.face_vertex.add_if(hit, f, v);
    }
  }
  for (int i = 0; i < ra.edges; ++i) {
    const int e = ra.edge[i];
    for (int j = 0; j < rb.edges; ++j) {
      const int f = rb.edge[j];
      bool hit = overlap(ba.edge[e], bb.edge[f]);
      if constexpr (one) hit &= !neighbours(ta.edge_adjacency[e], tb.edge_adjacency[f]);
      out.edge_edge.add_if(hit, e, f);
    }
  }
}

/// The same within one leaf; every unordered pair once.
inline void collect_pairs_within(const Tree& tree, const Boxes& boxes, int leaf, LeafPairs& out) {
  out.vertex_face.size = out.face_vertex.size = out.edge_edge.size = 0;
  for (int v = tree.leaf_vertex[leaf]; v < tree.leaf_vertex[leaf + 1]; ++v) {
    for (int f = tree.leaf_face[leaf]; f < tree.leaf_face[leaf + 1]; ++f) {
      out.vertex_face.add_if(overlap(boxes.vertex[v], boxes.face[f]) & !neighbours(tree.adjacency[v], tree.face_adjacency[f]), v, f);
    }
  }
  for (int e = tree.leaf_edge[leaf]; e < tree.leaf_edge[leaf + 1]; ++e) {
    for (int f = e + 1; f < tree.leaf_edge[leaf + 1]; ++f) {
      out.edge_edge.add_if(overlap(boxes.edge[e], boxes.edge[f]) & !neighbours(tree.edge_adjacency[e], tree.edge_adjacency[f]), e, f);
    }
  }
}

}  // namespace toile::contact
