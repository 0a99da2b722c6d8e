// What a fitting is judged by: figures of a garment, and of a garment on a body. docs/measures.md.
#pragma once

#include "toile/base/fields.h"
#include "toile/inspect/json.h"
#include "toile/inspect/strain.h"
#include "toile/mesh/garment_mesh.h"
#include "toile/mesh/support_mesh.h"

#include <map>
#include <optional>
#include <string>
#include <vector>

namespace toile::inspect {

/// A level at which a tape is laid round.
struct GirthRequest {
  std::string name;
  std::string at;                ///< landmark of the support
  std::optional<double> height;  ///< [m]
  std::vector<std::string> panels;
  static void describe(auto& f) {
    f(&GirthRequest::name, {.key = "name", .doc = "name in the result", .required = true});
    f(&GirthRequest::at, {.key = "at", .doc = "landmark of the support whose height is taken: its name, or that name with _front or _left"});
    f(&GirthRequest::height, {.key = "height", .doc = "height instead of a landmark", .unit = "m", .min = -100, .max = 100});
    f(&GirthRequest::panels, {.key = "panels", .doc = "only these panels; empty: all"});
    f.check([](const GirthRequest& r, Issues& issues) {
      if (r.at.empty() == !r.height) issues.push_back(Issue{"bad_girth", {.item = "at"}, "a girth needs either 'at' or 'height'", "give one of the two", Category::input});
    });
  }
};

/// A finished length: along runs, or between two points.
struct LengthRequest {
  std::string name;
  std::vector<std::string> runs;  ///< panel.run
  std::string from, to;           ///< panel.point
  static void describe(auto& f) {
    f(&LengthRequest::name, {.key = "name", .doc = "name in the result", .required = true});
    f(&LengthRequest::runs, {.key = "runs", .doc = "panel.run, one after another along the cloth"});
    f(&LengthRequest::from, {.key = "from", .doc = "panel.point"});
    f(&LengthRequest::to, {.key = "to", .doc = "panel.point; the straight distance and the drop between the two are given"});
    f.check([](const LengthRequest& r, Issues& issues) {
      const bool points = !r.from.empty() || !r.to.empty();
      if (r.runs.empty() == !points || r.from.empty() != r.to.empty())
        issues.push_back(Issue{"bad_length", {.item = "runs"}, "a length needs either 'runs', or both 'from' and 'to'", "give one of the two", Category::input});
    });
  }
};

/// What must hold for the garment to pass; a violated one makes exit code 4.
struct Checks {
  std::optional<double> max_strain;  ///< warp or weft [1]
  std::optional<double> max_compression;
  std::optional<double> max_shear;   ///< [rad]
  std::optional<int> penetrating_vertices, self_intersections, support_intersections;
  std::optional<double> max_seam_gap;   ///< [m]
  std::optional<double> max_seam_mismatch;  ///< flat, relative [1]
  std::optional<double> mass_error;     ///< relative [1]
  bool converged = false;
  static void describe(auto& f) {
    f(&Checks::max_strain, {.key = "max_strain", .doc = "greatest warp or weft strain of any face", .unit = "1", .min = 0, .max = 10});
    f(&Checks::max_compression, {.key = "max_compression", .doc = "greatest warp or weft shortening of any face", .unit = "1", .min = 0, .max = 1});
    f(&Checks::max_shear, {.key = "max_shear", .doc = "greatest shear angle of any face", .unit = "rad", .min = 0, .max = 1.6});
    f(&Checks::penetrating_vertices, {.key = "penetrating_vertices", .doc = "so many vertices may be inside the support", .min = 0});
    f(&Checks::self_intersections, {.key = "self_intersections", .doc = "so many pairs of faces may cut each other", .min = 0});
    f(&Checks::support_intersections, {.key = "support_intersections", .doc = "so many faces may cut the support", .min = 0});
    f(&Checks::max_seam_gap, {.key = "max_seam_gap", .doc = "greatest distance between vertices that are sewn together", .unit = "m", .min = 0, .max = 10});
    f(&Checks::max_seam_mismatch, {.key = "max_seam_mismatch", .doc = "greatest relative difference between the two sides of a seam as cut", .unit = "1", .min = 0, .max = 10});
    f(&Checks::mass_error, {.key = "mass_error", .doc = "greatest relative difference between mass and cut area times areal density", .unit = "1", .min = 0, .max = 1});
    f(&Checks::converged, {.key = "converged", .doc = "the simulation must have come to rest"});
  }
};

struct MeasureParams {
  std::vector<GirthRequest> girths;
  std::vector<LengthRequest> lengths;
  Checks checks;
  static void describe(auto& f) {
    f(&MeasureParams::girths, {.key = "girths", .doc = "where the tape is laid round; empty: at chest, bust, waist, hip and seat, as far as the support has them and the garment reaches"});
    f(&MeasureParams::lengths, {.key = "lengths", .doc = "finished lengths to report"});
    f(&MeasureParams::checks, {.key = "checks", .doc = "conditions for exit code 0; those not named are not checked"});
  }
};

struct Spread {
  double min = 0, p01 = 0, median = 0, p99 = 0, max = 0;
};
/// Order statistics: the value of rank floor(q n) of the sorted values. Zeros for none.
Spread spread(std::vector<double> values);

struct PanelFigures {
  std::string name, piece;
  bool mirrored = false;
  std::size_t vertices = 0, faces = 0;
  double cut_area = 0, flat_area = 0, area = 0;  ///< of the true outline, of the mesh as cut, now [m2]
  double mass = 0, mass_expected = 0;            ///< [kg]
  Spread strain_warp, strain_weft;               ///< [1]
  double max_shear = 0;                          ///< [rad]
  double min_angle = 0;                          ///< smallest corner of a triangle as cut [rad]
  std::optional<Spread> ease;                    ///< [m]
};

struct SeamFigures {
  std::string name, kind;
  std::size_t welds = 0;
  double cut_a = 0, cut_b = 0;  ///< along the true curves [m]
  double now_a = 0, now_b = 0;  ///< along the mesh, as it is [m]
  double max_gap = 0, mean_gap = 0;  ///< [m]
};

/// A closed border of the sewn garment: neck, hem, sleeve end …
struct OpeningFigures {
  std::vector<std::string> runs;  ///< panel.run, in order
  double flat = 0, now = 0;       ///< length as cut, as it is [m]
  double tape = 0;                ///< convex girth in the opening's plane [m]
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< [m]
};

struct GirthFigures {
  std::string name;
  double height = 0;                   ///< [m]
  std::optional<double> girth;         ///< along the cloth, where the section closes [m]
  std::optional<double> tape;          ///< pulled tight [m]
  std::optional<double> body;          ///< tape girth of the support at that height [m]
};

struct RunFigures {
  std::string panel, name;
  bool internal = false;
  double cut = 0, flat = 0, now = 0;  ///< true curve, mesh as cut, as it is [m]
};

struct LengthFigures {
  std::string name;
  std::optional<double> cut, now;        ///< along runs [m]
  std::optional<double> straight, drop;  ///< between points; drop: from above to [m]
};

/// Relations to a support.
struct SupportFigures {
  std::size_t penetrating_vertices = 0;
  double max_penetration = 0;            ///< [m]
  std::optional<std::size_t> support_intersections; ///< faces that cut the support's surface; none: not searched
  Spread ease;                           ///< signed distance of vertices to the support [m]
  double mean_ease = 0;
  std::vector<double> vertex_ease;       ///< |V| [m]
};

struct Figures {
  std::optional<bool> converged;
  std::map<std::string, std::string> marks;
  std::size_t vertices = 0, particles = 0, faces = 0, welds = 0, fasteners = 0;
  int pieces = 0, euler_number = 0;
  FaceStrain strain;
  Spread warp, weft, bias, shear;  ///< shear: amounts [rad]
  FaceTension tension;
  double max_tension_warp = 0, max_tension_weft = 0;  ///< [N/m]
  double max_seam_gap = 0, mean_seam_gap = 0, total_seam_gap = 0;  ///< [m]
  double mass = 0, mass_expected = 0;                 ///< [kg]
  double cut_area = 0, flat_area = 0, area = 0;       ///< [m2]
  double min_angle = 0;                               ///< [rad]
  std::size_t unassigned_faces = 0;                   ///< without a laminate: they weigh nothing
  Eigen::Vector3d centre_of_mass = Eigen::Vector3d::Zero(), low = Eigen::Vector3d::Zero(), high = Eigen::Vector3d::Zero();
  std::optional<std::size_t> self_intersections, self_intersecting_faces;  ///< none: not searched
  std::optional<SupportFigures> support;
  std::vector<PanelFigures> panels;
  std::vector<SeamFigures> seams;
  std::vector<OpeningFigures> openings;
  std::vector<GirthFigures> girths;
  std::vector<RunFigures> runs;
  std::vector<LengthFigures> lengths;
};

/// One row a panel (without ease) and one a seam: what needs no search.
std::vector<PanelFigures> panel_table(const mesh::GarmentMesh& garment, const FaceStrain& strain);
std::vector<SeamFigures> seam_table(const mesh::GarmentMesh& garment);

enum class Depth {
  full,
  quick,  ///< no search for intersections
};

/// All figures. `support` may be null: then nothing is said about it.
/// error  Issue "unknown_landmark", "unknown_panel", "unknown_run", "unknown_point", "needs_support", naming the request
Result<Figures> measure(const MeasureParams& params, const mesh::GarmentMesh& garment, const mesh::SupportMesh* support, Depth depth = Depth::full);

/// The violated checks, each an issue of Category::check.
Issues failed_checks(const Checks& checks, const Figures& figures, const mesh::GarmentMesh& garment);

/// Distance of points to a closed surface [m], |P|; negative inside (by winding number).
std::vector<double> signed_distances(const mesh::Points3& points, const mesh::SupportMesh& support);

/// Positions of particles (means over their vertices) and faces between particles: the garment as if its seams were merged.
struct SewnSurface {
  mesh::Points3 x;
  mesh::Triangles faces;
  mesh::Ids particle;  ///< of every vertex
};
SewnSurface sewn_surface(const mesh::GarmentMesh& garment);

/// Figures as JSON; SI units throughout, stated in the file.
Json to_json(const Figures& figures);
/// Tables as CSV with a header line (name [unit]).
std::string panels_csv(const Figures& figures);
std::string seams_csv(const Figures& figures);

/// The garment with the columns strain_warp, strain_weft, strain_bias, shear, tension_warp, tension_weft of faces and ease
/// (with a support) of vertices.
mesh::GarmentMesh with_maps(mesh::GarmentMesh garment, const Figures& figures);

}  // namespace toile::inspect
