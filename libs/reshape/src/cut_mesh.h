// A triangle surface that lines are cut into: sections by planes and paths from point to point become rows of edges.
#pragma once

#include "toile/reshape/surface.h"

#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

namespace toile::reshape {

using EdgeKey = std::pair<int, int>;
inline EdgeKey edge_key(int a, int b) { return {std::min(a, b), std::max(a, b)}; }

struct CutMesh {
  std::vector<Eigen::Vector3d> x;
  std::vector<std::array<int, 3>> faces;
  std::vector<int> part;                 ///< of faces
  std::map<EdgeKey, int> lines;          ///< line that an edge belongs to
  std::set<int> held;                    ///< vertices that must not be moved: named points
  std::map<int, std::string> names;      ///< of vertices

  explicit CutMesh(const Surface& surface);
  /// A vertex at the closest place of the surface; within `snap` of a line it is put on that line.
  int insert_point(const Eigen::Vector3d& point, double snap);
  /// Cuts along the section by a plane: of several curves the one nearest to `point`. Faces with keep[part + 1] == 0 are left
  /// alone. Returns the number of edges.
  int cut_plane(const Eigen::Vector3d& point, const Eigen::Vector3d& normal, const std::vector<char>& keep_part, int line);
  /// Cuts from vertex to vertex along the section by the plane that holds both and the surface's normals there (half
  /// the sum). Returns the number of edges, 0 where the section does not lead there.
  int cut_path(int from, int to, int line);

  Eigen::Vector3d vertex_normal(int v) const;

 private:
  struct Node {
    int a, b;  ///< an edge that the plane crosses; a == b: a vertex on it
    auto operator<=>(const Node&) const = default;
  };
  struct Section {
    std::map<Node, std::vector<Node>> next;
  };
  std::map<EdgeKey, std::vector<int>> edge_faces() const;
  int split(int a, int b, const Eigen::Vector3d& at, std::map<EdgeKey, std::vector<int>>& around);
  Section section(const Eigen::VectorXd& height, const std::vector<char>& keep_part) const;
  Eigen::Vector3d place(const Node& node, const Eigen::VectorXd& height) const;
  /// Moves vertices that lie close to the plane onto it, along their edges; sets their height to 0.
  void snap_vertices(Eigen::VectorXd& height, const std::set<Node>& wanted);
  int realise(const std::vector<std::pair<Node, Node>>& steps, const Eigen::VectorXd& height, int line);
};

}  // namespace toile::reshape
