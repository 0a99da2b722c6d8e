// What the tests have in common: strips of cloth as patterns, fabrics, meshes, specs.
#pragma once

#include "toile/lab/experiments.h"

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

namespace toile::lab {

enum class Net { grid, single, delaunay, jittered };
inline constexpr std::array all_nets{Net::grid, Net::single, Net::delaunay, Net::jittered};
const char* name_of(Net net);

enum class Model { woven, particle };
const char* name_of(Model model);
std::vector<Model> models(const Scope& scope);

/// SI. Tensile curves as EMT at F_max with LT.
struct Cloth {
  double weight = 0.2;
  double force_max = 100;
  double emt_warp = 0.01, emt_weft = 0.01, lt_warp = 1, lt_weft = 1, rt_warp = 1, rt_weft = 1;
  double b_warp = 2e-5, b_weft = 2e-5, hb_warp = 0, hb_weft = 0;  ///< hb: 2HB
  double g = 40, hg = 0, hg5 = 0;
  double twist = 0.3;
  double friction = 0.2;
};
std::string fabric_yaml(const Cloth& cloth);
/// A wool suiting with loops, the values of samples/fabrics/suiting.yaml.
Cloth suiting();

/// A strip along an axis, its sides low, tip, high, clamp; the warp at an angle to the axis. Whole, or cut in two through its
/// middle at an angle to the axis and sewn together again.
struct Strip {
  double length = 0, width = 0;  ///< [m]
  double warp = 0;               ///< [degrees]
  double cell = 0;               ///< [m]
  Net net = Net::grid;
  std::optional<double> cut;     ///< [degrees]
  double anchor = 0;             ///< length behind the clamp's line `inner`: rows that a model without tangent planes holds instead
  std::string file_name() const;
};
Eigen::Vector3d along(const Strip& strip);   ///< axis in space, as the mesh lies
Eigen::Vector3d across(const Strip& strip);
/// Where a point of an uncut strip lies (length along it from the clamp, across it) once it is meshed.
Eigen::Vector3d place(const Strip& strip, double length, double width);
/// toile-mesh, toile-sew where it is cut, toile-layer and toile-simulate. `deform`: spec of a toile-deform before the simulation.
Case strip_case(const std::string& name, const Strip& strip, const Cloth& cloth, const std::string& simulation, const std::string& deform = "");

/// Edges of that name, of all panels of the strip: "[strip.tip]".
std::string edges(const Strip& strip, const std::string& edge);

/// [x, y, z]
std::string vector_yaml(const Eigen::Vector3d& v);
/// A constraint with a path through these shifts and turns at times 0, 1, 2 …
std::string path_yaml(const std::string& name, const std::string& on, const std::string& kind, const std::vector<Eigen::Vector3d>& moves, const std::vector<double>& turns = {},
                      const Eigen::Vector3d& axis = Eigen::Vector3d::UnitZ(), const std::optional<Eigen::Vector3d>& centre = {});

/// x, y, z columns of a record in a direction: name.force_x_N …
std::vector<double> component(const Table& record, const std::string& name, const std::string& what, const std::string& unit, const Eigen::Vector3d& direction);
/// Mean position of a watched place at row i.
Eigen::Vector3d watched(const Table& record, const std::string& name, std::size_t row);
std::size_t row_count(const Table& record);

/// A row for a case that gave nothing carries the case's trouble.
Row row_of(const std::string& test, const std::string& subject, Model model, const std::string& mesh, const std::string& quantity, const std::string& unit, const Outcome& outcome);

/// Greatest over least minus one of the values of several rows, as a row; no value where one of them has none.
Row spread_of(const std::vector<Row>& rows, double target);

/// Line through points by least squares: {value at 0, slope}.
std::array<double, 2> line_fit(const std::vector<double>& x, const std::vector<double>& y);
double interpolated(const std::vector<double>& x, const std::vector<double>& y, double at);  ///< x increasing or decreasing

std::vector<Experiment> bending_tests(const Scope& scope);
std::vector<Experiment> membrane_tests(const Scope& scope);
std::vector<Experiment> seam_tests(const Scope& scope);
std::vector<Experiment> shape_tests(const Scope& scope);

}  // namespace toile::lab
