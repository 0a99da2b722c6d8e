// A plane triangulation that is improved in place, patch by patch.
#pragma once

#include <Eigen/Core>

#include <array>
#include <functional>
#include <set>
#include <utility>
#include <vector>

namespace toile::tailor {

using Point = Eigen::Vector2d;
using Triple = std::array<int, 3>;

enum class Mobility : unsigned char {
  fixed,  ///< never moves: corners, named points, borders whose curve is not known
  slide,  ///< moves along its curve
  free,   ///< moves in the plane
};

struct LocalVertex {
  Point p = Point::Zero();
  Mobility mobility = Mobility::free;
  int curve = -1;  ///< curve of a vertex that slides
  double s = 0;    ///< place on that curve
};

/// Triangles with the vertices' stars. Removed triangles keep their place with vertex ids -1.
struct LocalMesh {
  std::vector<LocalVertex> vertices;
  std::vector<Triple> triangles;
  std::vector<std::vector<int>> stars;        ///< alive triangles of each vertex, ascending
  std::set<std::pair<int, int>> constraints;  ///< inner edges (a < b) that must not be flipped or crossed
};

void build_stars(LocalMesh& mesh);

struct ImproveOptions {
  double target = 20;        ///< angle that every triangle should reach [deg]
  double good = 26;          ///< angle above which nothing is touched any more [deg]
  bool may_remove = true;    ///< inner vertices and sliding border vertices may be taken out
  bool may_insert = true;    ///< edges may be split
  bool may_split_border = true;
  double shortest_edge = 0.2;  ///< no insertion makes an edge shorter than this
  int passes = 12;
  /// Only triangles around these vertices are looked at first; empty: all.
  std::vector<int> around;
  /// Position on a curve; not called where no vertex slides.
  std::function<Point(int curve, double s)> curve_point;
};

/// Raises the smallest angles by edge flips, moving vertices, removing and inserting them. Only the neighbourhoods of
/// bad triangles change. An angle between two border edges or constraints belongs to the outline and does not count.
void improve(LocalMesh& mesh, const ImproveOptions& options);

/// Moves free vertices by up to `amount` along either coordinate and sliding ones along their curve, the same way in every run. Vertices of
/// constraints stay. A move is halved until it leaves no angle below 18 degrees that was not below before, and at last not made.
void jitter(LocalMesh& mesh, double amount, const std::function<Point(int curve, double s)>& curve_point);

/// Gives a triangle other vertices.
void replace_triangle(LocalMesh& mesh, int triangle, const Triple& vertices);

/// Puts a vertex into an edge and cuts the triangles at it; returns the vertex. Precondition: the edge exists.
int split_edge(LocalMesh& mesh, int a, int b, const LocalVertex& vertex);

/// Smallest angle of a triangle [deg], negative where it is turned over.
double smallest_angle(const Point& a, const Point& b, const Point& c);
/// The three angles at a, b, c [deg], all -1 where it is turned over.
std::array<double, 3> angles(const Point& a, const Point& b, const Point& c);

}  // namespace toile::tailor
