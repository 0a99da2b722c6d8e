#include <Eigen/Geometry>
#include "toile/contact/search.h"

#include "toile/base/result.h"
#include "tree.h"

#include <algorithm>
#include <cstring>
#include <optional>

namespace toile::contact {
namespace {

constexpr std::size_t leaf_grain = 64;  // leaves of a chunk

// Positions of one mesh in tree order, with the caller's array kept to see what has not changed.
struct Positions {
  std::vector<Vec> x;
  Points3 source;

  bool same(const Points3& other) const {
    return source.rows() == other.rows() && std::memcmp(source.data(), other.data(), sizeof(double) * other.size()) == 0;
  }
  void load(const Tree& tree, const Points3& from) {
    x.resize(tree.vertex_id.size());
    parallel_for(x.size(), 4096, [&](std::size_t i) { x[i] = from.row(tree.vertex_id[i]).transpose(); });
  }
};

struct Candidate {
  int a, b;  // local primitive ids
};

// A pair of a list and its distance at the reference [m], rounded down.
struct Near {
  Candidate pair;
  float distance;
};

struct Impact {
  int pair;  // index in the chunk's list
  double time;
  bool touching;
};

// What one chunk of leaves finds.
struct Chunk {
  std::vector<Contact> contacts[5];
  std::vector<Candidate> candidates[5];
  std::vector<Impact> impacts[5];
  void clear_contacts() {
    for (auto& c : contacts) c.clear();
  }
  void clear_candidates() {
    for (auto& c : candidates) c.clear();
    for (auto& c : impacts) c.clear();
  }
};

constexpr Kind all_kinds[] = {Kind::vertex_face, Kind::edge_edge, Kind::vertex_support_face, Kind::support_vertex_face,
                              Kind::edge_support_edge};
constexpr bool is_support(Kind kind) { return kind >= Kind::vertex_support_face; }
constexpr bool is_edge_pair(Kind kind) { return first_count(kind) == 2; }

double smooth_step(double t) {
  t = std::clamp(t, 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

}  // namespace

struct Search::Impl {
  Surface cloth, support;
  Tree cloth_tree, support_tree;
  bool has_support = false;
  Boxes self_boxes, against_boxes, support_boxes;

  // proximity
  Positions cloth_at, support_at;
  std::vector<Chunk> chunks;
  struct KindScratch {
    std::vector<Contact> sorted;
    std::vector<int> bucket;
    std::vector<Vec> directions;
    std::vector<std::array<int, 3>> patch_faces;
  };
  KindScratch scratch[5];
  std::vector<Contact> self_contacts, support_contacts;

  // Pairs that were nearer than `reach` at the reference positions. While no node has moved far from its reference since,
  // every pair of interest is among them and the hierarchies need not be asked.
  struct NearList {
    bool valid = false;
    double reach = 0;
    std::vector<Vec> reference, support_reference;
    std::vector<Vec> previous, support_previous;  // positions of the last call: how fast things move
    std::vector<std::array<std::vector<Near>, 5>> chunks;
  };
  NearList near_self, near_support;

  // Pairs whose boxes overlapped, with the boxes of all cloth nodes: complete while every node stays in its box, whatever happens there. The
  // iterations of one step look at nearly the same place again and again; boxes with a reserve save them the hierarchies.
  struct PairStore {
    bool valid = false;
    std::vector<Box> box;  // of each local cloth vertex
    std::vector<std::array<std::vector<Candidate>, 5>> chunks;
  };
  PairStore stored_self, stored_support;
  double slack = 0;  // what a list reaches beyond the radius asked for [m]

  // steps
  Positions cloth_from, cloth_to, support_from, support_to;
  std::vector<Vec> cloth_u, support_u;        // displacements in force
  std::vector<double> fraction, lowered;      // per local cloth vertex
  std::vector<std::uint8_t> changed, self_exempt, support_exempt;
  bool support_moves = false, support_changed = false;
  double support_lowered = 1;
  StepLimit limit;

  // ---------------------------------------------------------------- pairs

  // Nodes of a pair: local ids, first `own` of the cloth tree or of the support tree as the kind says.
  struct Nodes {
    std::array<int, 4> id;
    std::array<bool, 4> of_support;
  };
  template <Kind kind>
  Nodes nodes(const Candidate& c) const {
    const Tree& t = cloth_tree;
    const Tree& s = support_tree;
    if constexpr (kind == Kind::vertex_face) {
      return {{c.a, t.face[c.b][0], t.face[c.b][1], t.face[c.b][2]}, {false, false, false, false}};
    } else if constexpr (kind == Kind::edge_edge) {
      return {{t.edge[c.a][0], t.edge[c.a][1], t.edge[c.b][0], t.edge[c.b][1]}, {false, false, false, false}};
    } else if constexpr (kind == Kind::vertex_support_face) {
      return {{c.a, s.face[c.b][0], s.face[c.b][1], s.face[c.b][2]}, {false, true, true, true}};
    } else if constexpr (kind == Kind::support_vertex_face) {
      return {{c.a, t.face[c.b][0], t.face[c.b][1], t.face[c.b][2]}, {true, false, false, false}};
    } else {
      return {{t.edge[c.a][0], t.edge[c.a][1], s.edge[c.b][0], s.edge[c.b][1]}, {false, false, true, true}};
    }
  }
  static std::array<Vec, 4> gather(const Nodes& n, const std::vector<Vec>& cloth_x, const std::vector<Vec>& support_x) {
    std::array<Vec, 4> x;
    for (int k = 0; k < 4; ++k) x[k] = n.of_support[k] ? support_x[n.id[k]] : cloth_x[n.id[k]];
    return x;
  }
  template <Kind kind>
  static constexpr PairType type() {
    return is_edge_pair(kind) ? PairType::edge_edge : PairType::vertex_face;
  }
  // The lower edge of the surface comes first, whatever the tree: results must not depend on its layout.
  Candidate ordered_edges(int i, int j) const {
    return cloth_tree.edge_id[i] < cloth_tree.edge_id[j] ? Candidate{i, j} : Candidate{j, i};
  }

  // Calls body.template operator()<kind>(chunk, candidate) for each pair of primitives with overlapping boxes; chunks in parallel.
  template <class Body>
  void self_pairs(const Body& body) {
    const Tree& t = cloth_tree;
    const Boxes& boxes = self_boxes;
    parallel_chunks(t.leaf_count(), leaf_grain, [&](std::size_t begin, std::size_t end) {
      Chunk& chunk = chunks[begin / leaf_grain];
      LeafPairs pairs;
      const auto work_off = [&] {
        for (int i = 0; i < pairs.vertex_face.size; ++i) {
          body.template operator()<Kind::vertex_face>(chunk, Candidate{pairs.vertex_face.pair[i][0], pairs.vertex_face.pair[i][1]});
        }
        for (int i = 0; i < pairs.face_vertex.size; ++i) {
          body.template operator()<Kind::vertex_face>(chunk, Candidate{pairs.face_vertex.pair[i][1], pairs.face_vertex.pair[i][0]});
        }
        for (int i = 0; i < pairs.edge_edge.size; ++i) {
          body.template operator()<Kind::edge_edge>(chunk, ordered_edges(pairs.edge_edge.pair[i][0], pairs.edge_edge.pair[i][1]));
        }
      };
      for (int leaf = static_cast<int>(begin); leaf < static_cast<int>(end); ++leaf) {
        collect_pairs_within(t, boxes, leaf, pairs);
        work_off();
        for_each_leaf(t, boxes, boxes.node[t.leaf_node[leaf]], leaf + 1, [&](int other) {
          collect_pairs<Between::one_surface>(t, boxes, leaf, t, boxes, other, pairs);
          work_off();
        });
      }
    });
  }
  template <class Body>
  void support_pairs(const Body& body) {
    const Tree& t = cloth_tree;
    parallel_chunks(t.leaf_count(), leaf_grain, [&](std::size_t begin, std::size_t end) {
      Chunk& chunk = chunks[begin / leaf_grain];
      LeafPairs pairs;
      for (int leaf = static_cast<int>(begin); leaf < static_cast<int>(end); ++leaf) {
        for_each_leaf(support_tree, support_boxes, against_boxes.node[t.leaf_node[leaf]], 0, [&](int other) {
          collect_pairs<Between::two_surfaces>(t, against_boxes, leaf, support_tree, support_boxes, other, pairs);
          for (int i = 0; i < pairs.vertex_face.size; ++i) {
            body.template operator()<Kind::vertex_support_face>(chunk, Candidate{pairs.vertex_face.pair[i][0], pairs.vertex_face.pair[i][1]});
          }
          for (int i = 0; i < pairs.face_vertex.size; ++i) {
            body.template operator()<Kind::support_vertex_face>(chunk, Candidate{pairs.face_vertex.pair[i][1], pairs.face_vertex.pair[i][0]});
          }
          for (int i = 0; i < pairs.edge_edge.size; ++i) {
            body.template operator()<Kind::edge_support_edge>(chunk, Candidate{pairs.edge_edge.pair[i][0], pairs.edge_edge.pair[i][1]});
          }
        });
      }
    });
  }
  static bool holds(const PairStore& store, const std::vector<Vec>& x0, const std::vector<Vec>& x1, double grow) {
    if (!store.valid || store.box.size() != x0.size()) return false;
    const int outside = parallel_reduce(
        x0.size(), 2048, 0,
        [&](std::size_t begin, std::size_t end) {
          for (std::size_t i = begin; i < end; ++i) {
            if (!contains(store.box[i], point_box(x0[i], x1[i], grow))) return 1;
          }
          return 0;
        },
        [](int p, int q) { return p + q; });
    return outside == 0;
  }
  // How much a motion may be worth a store: beyond, its boxes would hold too much of the neighbourhood.
  bool short_way(const std::vector<Vec>& x0, const std::vector<Vec>& x1) const { return &x0 == &x1 || farthest(x1, x0, Vec::Zero()) < slack; }

  // Calls body for all pairs of the cloth with itself (of the cloth with the support) that can come within twice `grow` (within `grow`) on the way
  // from x0 to x1, and for some others.
  template <class Body>
  void self_pairs_on_way(const std::vector<Vec>& x0, const std::vector<Vec>& x1, double grow, const Body& body) {
    if (holds(stored_self, x0, x1, grow)) return for_stored(stored_self, body);
    if (!short_way(x0, x1)) {
      self_boxes.refit(cloth_tree, x0, x1, grow);
      return self_pairs(body);
    }
    self_boxes.refit(cloth_tree, x0, x1, grow + slack);
    start_store(stored_self, self_boxes);
    self_pairs([&]<Kind kind>(Chunk& chunk, const Candidate& c) { keep<kind>(stored_self, chunk, c); });
    for_stored(stored_self, body);
  }
  template <class Body>
  void support_pairs_on_way(const std::vector<Vec>& x0, const std::vector<Vec>& x1, double grow, const Body& body) {
    if (holds(stored_support, x0, x1, grow)) return for_stored(stored_support, body);
    if (!short_way(x0, x1)) {
      against_boxes.refit(cloth_tree, x0, x1, grow);
      return support_pairs(body);
    }
    against_boxes.refit(cloth_tree, x0, x1, grow + slack);
    start_store(stored_support, against_boxes);
    support_pairs([&]<Kind kind>(Chunk& chunk, const Candidate& c) { keep<kind>(stored_support, chunk, c); });
    for_stored(stored_support, body);
  }
  void start_store(PairStore& store, const Boxes& boxes) {
    store.valid = true;
    store.box = boxes.vertex;
    store.chunks.resize(chunks.size());
    for (auto& kinds : store.chunks) {
      for (auto& part : kinds) part.clear();
    }
  }
  template <Kind kind>
  void keep(PairStore& store, const Chunk& chunk, const Candidate& c) const {
    store.chunks[static_cast<std::size_t>(&chunk - chunks.data())][static_cast<std::size_t>(kind)].push_back(c);
  }
  template <class Body>
  void for_stored(const PairStore& store, const Body& body) {
    parallel_for(chunks.size(), 1, [&](std::size_t i) {
      const auto run = [&]<Kind kind>() {
        for (const Candidate& c : store.chunks[i][static_cast<std::size_t>(kind)]) body.template operator()<kind>(chunks[i], c);
      };
      run.template operator()<Kind::vertex_face>();
      run.template operator()<Kind::edge_edge>();
      run.template operator()<Kind::vertex_support_face>();
      run.template operator()<Kind::support_vertex_face>();
      run.template operator()<Kind::edge_support_edge>();
    });
  }
  void size_chunks() { chunks.resize((cloth_tree.leaf_count() + leaf_grain - 1) / leaf_grain); }

  // ---------------------------------------------------------------- proximity

  // How much an edge pair counts: 1 where the faces of both edges lean away from the other edge, 0 where one leans towards it.
  template <Kind kind>
  double edge_share(const Candidate& c, const std::array<Vec, 4>& x, const Vec& normal) const {
    const auto lean = [](const Tree& tree, const std::vector<Vec>& at, int edge, const Vec& a, const Vec& b, const Vec& towards) {
      double most = -1;
      const Vec along = b - a;
      const double length_sq = along.squaredNorm();
      for (const int third : tree.edge_third[edge]) {
        if (third < 0 || !(length_sq > 0)) continue;
        Vec m = at[third] - a;
        m -= m.dot(along) / length_sq * along;
        const double size = m.norm();
        if (size > 0) most = std::max(most, m.dot(towards) / size);
      }
      return most;
    };
    const bool second_is_support = kind == Kind::edge_support_edge;
    const Tree& second = second_is_support ? support_tree : cloth_tree;
    const std::vector<Vec>& second_x = second_is_support ? support_at.x : cloth_at.x;
    const double worst = std::max(lean(cloth_tree, cloth_at.x, c.a, x[0], x[1], -normal), lean(second, second_x, c.b, x[2], x[3], normal));
    // Parallel edges change their closest points by jumps: they count less and less below a sine of 0.1.
    const Vec d1 = x[1] - x[0], d2 = x[3] - x[2];
    const double lengths_sq = d1.squaredNorm() * d2.squaredNorm();
    const double sine_sq = lengths_sq > 0 ? d1.cross(d2).squaredNorm() / lengths_sq : 0;
    return (1 - smooth_step(worst / 0.25)) * smooth_step(sine_sq / 0.01);
  }

  template <Kind kind>
  void test_near(Chunk& chunk, const Candidate& c, double radius) const {
    const Nodes n = nodes<kind>(c);
    const std::array<Vec, 4> x = gather(n, cloth_at.x, support_at.x);
    if (surely_apart<type<kind>()>(x, radius)) return;
    const Closest found_at = closest<type<kind>()>(x);
    if (found_at.distance_sq < radius * radius) add_contact<kind>(chunk, c, n, x, found_at);
  }

  template <Kind kind>
  void add_contact(Chunk& chunk, const Candidate& c, const Nodes& n, const std::array<Vec, 4>& x, const Closest& found_at) const {
    Contact contact;
    contact.kind = kind;
    contact.weight = found_at.weight;
    contact.distance = std::sqrt(found_at.distance_sq);
    if constexpr (is_edge_pair(kind)) {
      for (const double w : contact.weight) {
        if (w == 0) return;  // at an end: a vertex-face contact
      }
      Vec normal = Vec::Zero();
      for (int k = 0; k < 4; ++k) normal += contact.weight[k] * x[k];
      if (contact.distance > 0) normal /= contact.distance;
      contact.share = edge_share<kind>(c, x, normal);
      if (!(contact.share > 0)) return;
    }
    const Tree& second = kind == Kind::vertex_support_face || kind == Kind::edge_support_edge ? support_tree : cloth_tree;
    const Tree& first = kind == Kind::support_vertex_face ? support_tree : cloth_tree;
    contact.a = is_edge_pair(kind) ? first.edge_id[c.a] : first.vertex_id[c.a];
    contact.b = is_edge_pair(kind) ? second.edge_id[c.b] : second.face_id[c.b];
    for (int k = 0; k < 4; ++k) contact.node[k] = (n.of_support[k] ? support_tree : cloth_tree).vertex_id[n.id[k]];
    chunk.contacts[static_cast<int>(kind)].push_back(contact);
  }

  Vec gap(const Contact& c, const Points3& x, const Points3& support_x) const {
    Vec g = Vec::Zero();
    for (int k = 0; k < 4; ++k) {
      const bool of_support = (c.kind == Kind::vertex_support_face && k > 0) || (c.kind == Kind::support_vertex_face && k == 0) ||
                              (c.kind == Kind::edge_support_edge && k > 1);
      g += c.weight[k] * (of_support ? support_x : x).row(c.node[k]).transpose();
    }
    return g;
  }

  // Orders a kind's contacts by (a, b); of a vertex's faces that hang together keeps the nearest.
  void sort_kind(Kind kind, const Points3& x, const Points3& support_x) {
    KindScratch& work = scratch[static_cast<int>(kind)];
    auto& out = work.sorted;
    auto& bucket = work.bucket;
    const Surface& first = kind == Kind::support_vertex_face ? support : cloth;
    const std::size_t keys = is_edge_pair(kind) ? first.edges.size() : static_cast<std::size_t>(first.node_count);
    bucket.assign(keys + 1, 0);
    std::size_t total = 0;
    for (const Chunk& chunk : chunks) {
      for (const Contact& c : chunk.contacts[static_cast<int>(kind)]) ++bucket[c.a + 1];
      total += chunk.contacts[static_cast<int>(kind)].size();
    }
    out.resize(total);
    if (total == 0) return;
    for (std::size_t i = 0; i < keys; ++i) bucket[i + 1] += bucket[i];
    for (const Chunk& chunk : chunks) {
      for (const Contact& c : chunk.contacts[static_cast<int>(kind)]) out[bucket[c.a]++] = c;
    }
    // Now bucket[a] is the end of a's contacts.
    const Surface& second = kind == Kind::vertex_support_face ? support : cloth;
    std::size_t kept_total = 0;
    for (std::size_t begin = 0; begin < out.size();) {
      const std::size_t end = bucket[out[begin].a];
      const auto at = [&](std::size_t i) { return out.begin() + static_cast<std::ptrdiff_t>(i); };
      std::size_t kept_end = end;
      if (!is_edge_pair(kind) && end - begin > 1) {
        std::sort(at(begin), at(end), [](const Contact& p, const Contact& q) {
          return p.distance != q.distance ? p.distance < q.distance : p.b < q.b;
        });
        kept_end = keep_nearest_of_patches(second, work, begin, end, x, support_x);
      }
      if (kept_end - begin > 1) std::sort(at(begin), at(kept_end), [](const Contact& p, const Contact& q) { return p.b < q.b; });
      if (kept_total == begin) {
        kept_total = kept_end;
      } else {
        for (std::size_t i = begin; i < kept_end; ++i) out[kept_total++] = out[i];
      }
      begin = end;
    }
    out.resize(kept_total);
  }

  std::size_t keep_nearest_of_patches(const Surface& second, KindScratch& work, std::size_t begin, std::size_t end, const Points3& x,
                                      const Points3& support_x) const {
    work.directions.clear();
    work.patch_faces.clear();
    std::size_t kept = begin;
    for (std::size_t i = begin; i < end; ++i) {
      const Contact c = work.sorted[i];
      Vec n = gap(c, x, support_x);
      const double size = n.norm();
      if (size > 0) n /= size;
      std::array<int, 3> face{second.faces(c.b, 0), second.faces(c.b, 1), second.faces(c.b, 2)};
      for (int& id : face) id = second.adjacency[id];
      bool nearer_neighbour = false;
      for (std::size_t j = 0; j < work.directions.size() && !nearer_neighbour; ++j) {
        if (!(n.dot(work.directions[j]) > 0.5) && size > 0) continue;
        for (const int p : face) {
          for (const int q : work.patch_faces[j]) nearer_neighbour |= p == q;
        }
      }
      work.directions.push_back(n);
      work.patch_faces.push_back(face);
      if (!nearer_neighbour) work.sorted[kept++] = c;
    }
    return kept;
  }

  // ---------------------------------------------------------------- lists of near pairs

  // Largest |x - from - shift|.
  static double farthest(const std::vector<Vec>& x, const std::vector<Vec>& from, const Vec& shift) {
    const double largest_sq = parallel_reduce(
        x.size(), 4096, 0.0,
        [&](std::size_t begin, std::size_t end) {
          double part = 0;
          for (std::size_t i = begin; i < end; ++i) part = std::max(part, (x[i] - from[i] - shift).squaredNorm());
          return part;
        },
        [](double p, double q) { return std::max(p, q); });
    return std::sqrt(largest_sq);
  }
  // Half of the largest and smallest displacement per axis: a shift that all nodes have about in common.
  static Vec common_shift(const std::vector<Vec>& x, const std::vector<Vec>& from) {
    struct Range {
      Vec lo = Vec::Constant(INFINITY), hi = Vec::Constant(-INFINITY);
    };
    const Range all = parallel_reduce(
        x.size(), 4096, Range{},
        [&](std::size_t begin, std::size_t end) {
          Range r;
          for (std::size_t i = begin; i < end; ++i) {
            const Vec d = x[i] - from[i];
            r.lo = r.lo.cwiseMin(d), r.hi = r.hi.cwiseMax(d);
          }
          return r;
        },
        [](const Range& p, const Range& q) { return Range{p.lo.cwiseMin(q.lo), p.hi.cwiseMax(q.hi)}; });
    return x.empty() ? Vec(Vec::Zero()) : Vec(0.5 * (all.lo + all.hi));
  }

  // The distance that pairs coming within `radius` at x, at y or anywhere between had at most at the list's reference: a
  // pair's distance changes by no more than its two sides move against a common shift. Nothing if the list does not
  // reach that far.
  std::optional<double> self_list_distance(const std::vector<Vec>& x, const std::vector<Vec>& y, double radius) const {
    if (!near_self.valid || near_self.reference.size() != x.size()) return {};
    const Vec shift = common_shift(x, near_self.reference);
    double way = farthest(x, near_self.reference, shift);
    if (&y != &x) way = std::max(way, farthest(y, near_self.reference, shift));
    const double needed = (radius + 2 * way) * (1 + 1e-9);
    return needed < near_self.reach ? std::optional(needed) : std::nullopt;
  }
  std::optional<double> support_list_distance(const std::vector<Vec>& x, const std::vector<Vec>& y, const std::vector<Vec>& s,
                                              const std::vector<Vec>& t, double radius) const {
    const NearList& list = near_support;
    if (!list.valid || list.reference.size() != x.size()) return {};
    double way = farthest(x, list.reference, Vec::Zero()), support_way = farthest(s, list.support_reference, Vec::Zero());
    if (&y != &x) {
      way = std::max(way, farthest(y, list.reference, Vec::Zero()));
      support_way = std::max(support_way, farthest(t, list.support_reference, Vec::Zero()));
    }
    const double needed = (radius + way + support_way) * (1 + 1e-9);
    return needed < list.reach ? std::optional(needed) : std::nullopt;
  }

  // A list pays when things move so slowly that the next call will find it valid.
  template <Kind kind>
  void test_and_list(NearList& list, Chunk& chunk, const Candidate& c, double radius) const {
    const Nodes n = nodes<kind>(c);
    const std::array<Vec, 4> x = gather(n, cloth_at.x, support_at.x);
    if (surely_apart<type<kind>()>(x, list.reach)) return;
    const Closest found_at = closest<type<kind>()>(x);
    if (!(found_at.distance_sq < list.reach * list.reach)) return;
    list.chunks[&chunk - chunks.data()][static_cast<int>(kind)].push_back({c, static_cast<float>(std::sqrt(found_at.distance_sq) * (1 - 1e-7))});
    if (found_at.distance_sq < radius * radius) add_contact<kind>(chunk, c, n, x, found_at);
  }
  void start_list(NearList& list, double radius) {
    list.valid = true;
    list.reach = radius + slack;
    list.reference = cloth_at.x;
    list.chunks.resize(chunks.size());
    for (auto& kinds : list.chunks) {
      for (auto& part : kinds) part.clear();
    }
  }
  template <class Body>
  void for_list(const NearList& list, double distance, const Body& body) {
    parallel_for(chunks.size(), 1, [&](std::size_t i) {
      const auto run = [&]<Kind kind>() {
        for (const Near& near : list.chunks[i][static_cast<int>(kind)]) {
          if (near.distance < distance) body.template operator()<kind>(chunks[i], near.pair);
        }
      };
      run.template operator()<Kind::vertex_face>();
      run.template operator()<Kind::edge_edge>();
      run.template operator()<Kind::vertex_support_face>();
      run.template operator()<Kind::support_vertex_face>();
      run.template operator()<Kind::edge_support_edge>();
    });
  }

  void find_near_self(double radius) {
    const std::vector<Vec>& x = cloth_at.x;
    const std::optional<double> distance = self_list_distance(x, x, radius);
    const bool slow = near_self.previous.size() != x.size() || 2 * farthest(x, near_self.previous, common_shift(x, near_self.previous)) < slack;
    near_self.previous = x;
    if (distance) {
      for_list(near_self, *distance, [&]<Kind kind>(Chunk& chunk, const Candidate& c) { test_near<kind>(chunk, c, radius); });
    } else if (slow) {
      start_list(near_self, radius);
      self_boxes.refit(cloth_tree, x, x, 0.5 * near_self.reach);
      self_pairs([&]<Kind kind>(Chunk& chunk, const Candidate& c) { test_and_list<kind>(near_self, chunk, c, radius); });
    } else {
      self_pairs_on_way(x, x, 0.5 * radius, [&]<Kind kind>(Chunk& chunk, const Candidate& c) { test_near<kind>(chunk, c, radius); });
    }
  }
  void find_near_support(const Points3& support_x, double radius) {
    const std::vector<Vec>& x = cloth_at.x;
    support_at.load(support_tree, support_x);
    const std::vector<Vec>& s = support_at.x;
    NearList& list = near_support;
    const std::optional<double> distance = support_list_distance(x, x, s, s, radius);
    const bool slow = list.previous.size() != x.size() ||
                      farthest(x, list.previous, Vec::Zero()) + farthest(s, list.support_previous, Vec::Zero()) < slack;
    list.previous = x;
    list.support_previous = s;
    if (distance) {
      for_list(list, *distance, [&]<Kind kind>(Chunk& chunk, const Candidate& c) { test_near<kind>(chunk, c, radius); });
      return;
    }
    load_support(support_x, support_x);
    if (slow) {
      start_list(list, radius);
      list.support_reference = s;
      against_boxes.refit(cloth_tree, x, x, list.reach);
      support_pairs([&]<Kind kind>(Chunk& chunk, const Candidate& c) { test_and_list<kind>(list, chunk, c, radius); });
    } else {
      support_pairs_on_way(x, x, radius, [&]<Kind kind>(Chunk& chunk, const Candidate& c) { test_near<kind>(chunk, c, radius); });
    }
  }

  Contacts proximity(const Points3& x, const Points3& support_x, Radii radii) {
    TOILE_CHECK(x.rows() == cloth.node_count, "positions {} nodes {}", x.rows(), cloth.node_count);
    TOILE_CHECK(!has_support || support_x.rows() == support.node_count, "support positions {} nodes {}", support_x.rows(), support.node_count);
    size_chunks();
    for (Chunk& chunk : chunks) chunk.clear_contacts();
    cloth_at.load(cloth_tree, x);
    if (radii.self > 0) find_near_self(radii.self);
    if (has_support && radii.support > 0) find_near_support(support_x, radii.support);
    parallel_for(5, 1, [&](std::size_t k) { sort_kind(all_kinds[k], x, support_x); });
    const auto join = [&](std::vector<Contact>& to, std::initializer_list<Kind> kinds) {
      to.clear();
      for (const Kind kind : kinds) to.insert(to.end(), scratch[static_cast<int>(kind)].sorted.begin(), scratch[static_cast<int>(kind)].sorted.end());
    };
    join(self_contacts, {Kind::vertex_face, Kind::edge_edge});
    join(support_contacts, {Kind::vertex_support_face, Kind::support_vertex_face, Kind::edge_support_edge});
    return {self_contacts, support_contacts};
  }

  // Boxes of the support for the motion; nothing to do while it is still.
  void load_support(const Points3& s0, const Points3& s1) {
    TOILE_CHECK(s0.rows() == support.node_count && s1.rows() == support.node_count, "support positions {} {} nodes {}", s0.rows(),
                s1.rows(), support.node_count);
    if (support_from.same(s0) && support_to.same(s1)) return;
    support_from.source = s0;
    support_to.source = s1;
    support_from.load(support_tree, s0);
    support_to.load(support_tree, s1);
    support_boxes.refit(support_tree, support_from.x, support_to.x, 0);
    stored_support.valid = false;
  }

  // ---------------------------------------------------------------- steps

  // Loads a step and collects the candidates: pairs whose swept boxes come within the separation, and their impacts.
  void prepare_step(const Points3& x0, const Points3& x1, const LimitOptions& o) {
    TOILE_CHECK(x0.rows() == cloth.node_count && x1.rows() == cloth.node_count, "positions {} {} nodes {}", x0.rows(), x1.rows(),
                cloth.node_count);
    TOILE_CHECK(o.rewind > 0 && o.rewind < 1 && o.self_separation > 0 && o.support_separation > 0, "rewind {} separations {} {}",
                o.rewind, o.self_separation, o.support_separation);
    const auto fits = [&](std::span<const std::uint8_t> mask) { return mask.empty() || mask.size() == static_cast<std::size_t>(cloth.node_count); };
    TOILE_CHECK(fits(o.self_exempt) && fits(o.support_exempt), "exempt {} {} nodes {}", o.self_exempt.size(), o.support_exempt.size(),
                cloth.node_count);
    size_chunks();
    for (Chunk& chunk : chunks) chunk.clear_candidates();
    cloth_from.load(cloth_tree, x0);
    cloth_to.load(cloth_tree, x1);
    const std::size_t count = cloth_from.x.size();
    cloth_u.resize(count);
    const auto load_mask = [&](std::vector<std::uint8_t>& to, std::span<const std::uint8_t> from) {
      to.assign(from.empty() ? 0 : count, 0);
      for (std::size_t i = 0; i < to.size(); ++i) to[i] = from[cloth_tree.vertex_id[i]] != 0;
    };
    load_mask(self_exempt, o.self_exempt);
    load_mask(support_exempt, o.support_exempt);
    const double sum = parallel_reduce(
        count, 4096, 0.0,
        [&](std::size_t begin, std::size_t end) {
          double part = 0;
          for (std::size_t i = begin; i < end; ++i) {
            cloth_u[i] = cloth_to.x[i] - cloth_from.x[i];
            part += cloth_u[i].squaredNorm();
          }
          return part;
        },
        [](double p, double q) { return p + q; });
    TOILE_CHECK(std::isfinite(sum), "displacements are not finite, sum of squares {}", sum);
    // The boxes hold the whole ways at any fraction, so the candidates stay complete however nodes are rewound. Growth by
    // 1.1 separations would do (nearer is an impact); the rest covers rounding.
    if (const auto distance = self_list_distance(cloth_from.x, cloth_to.x, 1.2 * o.self_separation)) {
      for_list(near_self, *distance, [&]<Kind kind>(Chunk& chunk, const Candidate& c) { add_candidate<kind>(chunk, c, o.self_separation); });
    } else {
      self_pairs_on_way(cloth_from.x, cloth_to.x, 0.6 * o.self_separation, [&]<Kind kind>(Chunk& chunk, const Candidate& c) { add_candidate<kind>(chunk, c, o.self_separation); });
    }
    if (!has_support) return;
    if (const auto distance =
            support_list_distance(cloth_from.x, cloth_to.x, support_from.x, support_to.x, 1.2 * o.support_separation)) {
      for_list(near_support, *distance, [&]<Kind kind>(Chunk& chunk, const Candidate& c) { add_candidate<kind>(chunk, c, o.support_separation); });
    } else {
      support_pairs_on_way(cloth_from.x, cloth_to.x, 1.2 * o.support_separation, [&]<Kind kind>(Chunk& chunk, const Candidate& c) { add_candidate<kind>(chunk, c, o.support_separation); });
    }
  }

  template <Kind kind>
  bool exempt(const Nodes& n) const {
    if constexpr (is_support(kind)) {
      if (support_exempt.empty()) return false;
      for (int k = 0; k < 4; ++k) {
        if (!n.of_support[k] && support_exempt[n.id[k]]) return true;
      }
      return false;
    } else {
      if (self_exempt.empty()) return false;
      bool first = false, second = false;
      for (int k = 0; k < 4; ++k) (k < first_count(kind) ? first : second) |= self_exempt[n.id[k]] != 0;
      return first && second;
    }
  }

  // Keeps a pair unless it is safe whatever fraction of their displacement its nodes keep, and looks for its impact.
  template <Kind kind>
  void add_candidate(Chunk& chunk, const Candidate& c, double separation) const {
    const Nodes n = nodes<kind>(c);
    const std::array<Vec, 4> u = gather(n, cloth_u, support_u);
    double first = 0, second = 0;
    for (int k = 0; k < first_count(kind); ++k) first = std::max(first, u[k].squaredNorm());
    for (int k = first_count(kind); k < 4; ++k) second = std::max(second, u[k].squaredNorm());
    const double way = std::sqrt(first) + std::sqrt(second);
    if (way == 0) return;
    const std::array<Vec, 4> x = gather(n, cloth_from.x, support_from.x);
    if (surely_apart<type<kind>()>(x, way + separation) || exempt<kind>(n)) return;
    auto& list = chunk.candidates[static_cast<int>(kind)];
    const Approach a = approach<type<kind>()>(x, u, separation);
    if (a.impact) chunk.impacts[static_cast<int>(kind)].push_back({static_cast<int>(list.size()), a.time, a.touching});
    list.push_back(c);
  }

  // Calls body.template operator()<kind>(chunk, index, candidate) for all candidates, chunks in parallel.
  template <class Body>
  void for_candidates(const Body& body) {
    parallel_for(chunks.size(), 1, [&](std::size_t i) {
      Chunk& chunk = chunks[i];
      const auto run = [&]<Kind kind>() {
        const auto& list = chunk.candidates[static_cast<int>(kind)];
        for (int j = 0; j < static_cast<int>(list.size()); ++j) body.template operator()<kind>(chunk, j, list[j]);
      };
      run.template operator()<Kind::vertex_face>();
      run.template operator()<Kind::edge_edge>();
      run.template operator()<Kind::vertex_support_face>();
      run.template operator()<Kind::support_vertex_face>();
      run.template operator()<Kind::edge_support_edge>();
    });
  }

  static double separation_of(Kind kind, const LimitOptions& o) { return is_support(kind) ? o.support_separation : o.self_separation; }

  // Finds impacts among the candidates that have a changed node.
  void find_impacts(const LimitOptions& o) {
    for (Chunk& chunk : chunks) {
      for (auto& list : chunk.impacts) list.clear();
    }
    for_candidates([&]<Kind kind>(Chunk& chunk, int index, const Candidate& c) {
      const Nodes n = nodes<kind>(c);
      bool touched = is_support(kind) && support_changed;
      for (int k = 0; k < 4; ++k) touched |= !n.of_support[k] && changed[n.id[k]];
      if (!touched) return;
      const Approach a =
          approach<type<kind>()>(gather(n, cloth_from.x, support_from.x), gather(n, cloth_u, support_u), separation_of(kind, o));
      if (a.impact) chunk.impacts[static_cast<int>(kind)].push_back({index, a.time, a.touching});
    });
  }
  int count_impacts() const {
    int count = 0;
    for (const Chunk& chunk : chunks) {
      for (const auto& list : chunk.impacts) count += static_cast<int>(list.size());
    }
    return count;
  }

  // The new fractions that the impacts of this round ask for.
  void lower(const LimitOptions& o, bool fall_back) {
    for (const Chunk& chunk : chunks) {
      const auto run = [&]<Kind kind>() {
        for (const Impact& impact : chunk.impacts[static_cast<int>(kind)]) {
          const Nodes n = nodes<kind>(chunk.candidates[static_cast<int>(kind)][impact.pair]);
          if (fall_back) ++limit.fallback_pairs;
          double bound = 0;
          if (fall_back) {
            const double distance = std::sqrt(closest<type<kind>()>(gather(n, cloth_from.x, support_from.x)).distance_sq);
            bound = 0.9 * (distance - separation_floor(distance, separation_of(kind, o)));
            if (!is_support(kind) || support_moves) bound *= 0.5;
            if (impact.touching) bound = 0;
          }
          double support_way = 0;
          for (int k = 0; k < 4; ++k) {
            if (n.of_support[k]) {
              support_way = std::max(support_way, support_u[n.id[k]].norm());
              continue;
            }
            const int v = n.id[k];
            double keep = o.rewind * impact.time;
            if (fall_back) {
              const double way = cloth_u[v].norm();
              keep = way > bound ? bound / way : 1;
            }
            lowered[v] = std::min(lowered[v], fraction[v] * keep);
          }
          if (support_way > 0) {
            double keep = o.rewind * impact.time;
            if (fall_back) keep = support_way > bound ? bound / support_way : 1;
            support_lowered = std::min(support_lowered, limit.support_fraction * keep);
          }
        }
      };
      run.template operator()<Kind::vertex_face>();
      run.template operator()<Kind::edge_edge>();
      run.template operator()<Kind::vertex_support_face>();
      run.template operator()<Kind::support_vertex_face>();
      run.template operator()<Kind::edge_support_edge>();
    }
  }

  void load_support_step(const Points3& s0, const Points3& s1) {
    if (!has_support) return;
    load_support(s0, s1);
    const std::size_t count = support_from.x.size();
    support_u.resize(count);
    support_moves = false;
    for (std::size_t i = 0; i < count; ++i) {
      support_u[i] = support_to.x[i] - support_from.x[i];
      support_moves |= support_u[i] != Vec::Zero();
    }
  }

  const StepLimit& limit_step(const Points3& x0, const Points3& x1, const Points3& s0, const Points3& s1, const LimitOptions& o) {
    load_support_step(s0, s1);
    prepare_step(x0, x1, o);
    const std::size_t count = cloth_from.x.size();
    fraction.assign(count, 1.0);
    changed.assign(count, 0);
    limit.support_fraction = 1;
    limit.limited_pairs = limit.limited_nodes = limit.rounds = limit.fallback_pairs = limit.touching_pairs = 0;

    for (int round = 0;; ++round) {
      if (round > 0) find_impacts(o);
      const int impacts = count_impacts();
      if (round == 0) {
        limit.limited_pairs = impacts;
        for (const Chunk& chunk : chunks) {
          for (const auto& list : chunk.impacts) {
            for (const Impact& i : list) limit.touching_pairs += i.touching;
          }
        }
      }
      if (impacts == 0) break;
      ++limit.rounds;
      lowered = fraction;
      support_lowered = limit.support_fraction;
      lower(o, round >= o.rounds);
      support_changed = support_lowered != limit.support_fraction;
      limit.support_fraction = support_lowered;
      for (std::size_t i = 0; i < count; ++i) {
        changed[i] = lowered[i] != fraction[i];
        if (!changed[i]) continue;
        fraction[i] = lowered[i];
        const Vec end = cloth_from.x[i] + fraction[i] * (cloth_to.x[i] - cloth_from.x[i]);
        cloth_u[i] = end - cloth_from.x[i];
      }
      if (support_changed) {
        for (std::size_t i = 0; i < support_u.size(); ++i) {
          support_u[i] = limit.support_fraction * (support_to.x[i] - support_from.x[i]);
        }
      }
    }

    limit.x = x1;
    limit.fraction.assign(cloth.node_count, 1.0);
    limit.least_fraction = 1;
    for (std::size_t i = 0; i < count; ++i) {
      if (fraction[i] == 1) continue;
      const int v = cloth_tree.vertex_id[i];
      limit.fraction[v] = fraction[i];
      limit.x.row(v) = (cloth_from.x[i] + fraction[i] * (cloth_to.x[i] - cloth_from.x[i])).transpose();
      limit.least_fraction = std::min(limit.least_fraction, fraction[i]);
      ++limit.limited_nodes;
    }
    return limit;
  }

  double step_fraction(const Points3& x0, const Points3& x1, const Points3& s0, const Points3& s1, const LimitOptions& o) {
    load_support_step(s0, s1);
    prepare_step(x0, x1, o);
    double least = 1;
    for (const Chunk& chunk : chunks) {
      for (const auto& list : chunk.impacts) {
        for (const Impact& i : list) least = std::min(least, i.time);
      }
    }
    return least;
  }
};

Search::Search(Surface cloth, const Points3& x) : impl_(std::make_unique<Impl>()) {
  TOILE_CHECK(x.rows() == cloth.node_count, "positions {} nodes {}", x.rows(), cloth.node_count);
  impl_->cloth_tree = Tree(cloth, x);
  double edges = 0;
  for (const auto& [a, b] : cloth.edges) edges += (x.row(a) - x.row(b)).norm();
  impl_->slack = cloth.edges.empty() ? 0 : 0.2 * edges / static_cast<double>(cloth.edges.size());
  impl_->cloth = std::move(cloth);
}

Search::Search(Surface cloth, const Points3& x, Surface support, const Points3& support_x) : Search(std::move(cloth), x) {
  TOILE_CHECK(support_x.rows() == support.node_count, "positions {} nodes {}", support_x.rows(), support.node_count);
  impl_->support_tree = Tree(support, support_x);
  impl_->support = std::move(support);
  impl_->has_support = impl_->support.faces.rows() > 0;
}

Search::~Search() = default;
Search::Search(Search&&) noexcept = default;
Search& Search::operator=(Search&&) noexcept = default;

const Surface& Search::cloth() const { return impl_->cloth; }
const Surface& Search::support() const { return impl_->support; }

Contacts Search::proximity(const Points3& x, const Points3& support_x, Radii radii) { return impl_->proximity(x, support_x, radii); }

const StepLimit& Search::limit_step(const Points3& x0, const Points3& x1, const Points3& support_x0, const Points3& support_x1,
                                    const LimitOptions& options) {
  return impl_->limit_step(x0, x1, support_x0, support_x1, options);
}

double Search::step_fraction(const Points3& x0, const Points3& x1, const Points3& support_x0, const Points3& support_x1,
                             const LimitOptions& options) {
  return impl_->step_fraction(x0, x1, support_x0, support_x1, options);
}

}  // namespace toile::contact
