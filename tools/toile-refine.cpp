// Gives a garment the positions of the same garment on another grid.
#include <cmath>

#include "toile/base/units.h"
#include "toile/contact/exact.h"
#include "toile/contact/support_field.h"
#include "toile/contact/untangle.h"
#include "toile/stage/stage.h"
#include "toile/tailor/quality.h"
#include "toile/tailor/refine.h"

namespace {

using namespace toile;

struct Params {
  tailor::Interpolation interpolation = tailor::Interpolation::smooth;
  double clearance = 5e-4;
  bool untangle = true;
  std::string map;
  static void describe(auto& f) {
    f(&Params::interpolation, {.key = "interpolation",
                               .doc = "smooth: through tangents, exact for quadratic shapes; linear: every triangle of "
                                      "the coarse garment stays a plane"});
    f(&Params::clearance, {.key = "clearance",
                           .doc = "with a support: vertices nearer to it are moved out to this distance",
                           .unit = "m",
                           .min = 0,
                           .max = 0.1});
    f(&Params::untangle, {.key = "untangle", .doc = "cloth that cuts itself afterwards is pulled out of itself"});
    f(&Params::map, {.key = "map",
                     .doc = "file for the map (CSV): of every vertex the triangle of the coarse garment, its three "
                            "vertices and weights, and how far outside it lies [m]"});
  }
};

/// The garment as contact sees it: the sides of closed seams are one node.
struct Cloth {
  mesh::Ids node;  ///< of every vertex
  contact::Surface surface;
  explicit Cloth(const mesh::GarmentMesh& garment, const std::vector<char>& seam_closed)
      : node(tailor::closed_particles(garment, seam_closed)) {
    mesh::Triangles faces = garment.faces;
    for (Eigen::Index i = 0; i < faces.size(); ++i) faces.data()[i] = node[faces.data()[i]];
    const mesh::Ids particle = mesh::particles(garment);
    mesh::Ids adjacency(node.size() > 0 ? node.maxCoeff() + 1 : 0);
    for (Eigen::Index v = 0; v < node.size(); ++v) adjacency[node[v]] = particle[v];
    surface = contact::make_surface(static_cast<int>(adjacency.size()), faces, adjacency);
  }
  mesh::Points3 positions(const mesh::GarmentMesh& garment) const {
    mesh::Points3 x(surface.node_count, 3);
    for (Eigen::Index v = 0; v < node.size(); ++v) x.row(node[v]) = garment.x.row(v);
    return x;
  }
  void place(mesh::GarmentMesh& garment, const mesh::Points3& x) const {
    for (Eigen::Index v = 0; v < node.size(); ++v) garment.x.row(v) = x.row(node[v]);
  }
};

std::string csv(const tailor::PanelMap& map, const mesh::GarmentMesh& coarse) {
  std::string text = "vertex,face,a,b,c,weight_a,weight_b,weight_c,outside\n";
  for (Eigen::Index v = 0; v < map.face.size(); ++v) {
    const int f = map.face[v];
    text += fmt::format("{},{},{},{},{},{},{},{},{}\n", v, f, coarse.faces(f, 0), coarse.faces(f, 1),
                        coarse.faces(f, 2), map.weight(v, 0), map.weight(v, 1), map.weight(v, 2), map.outside[v]);
  }
  return text;
}

struct RefineStage {
  using Params = ::Params;

  static stage::Description description() {
    return {
        .name = "toile-refine",
        .version = 1,
        .summary = "Gives a garment the positions of the same garment on another grid.",
        .example = "toile-refine layered_fine.ply draped_coarse.ply -o start.ply",
        .details =
            "Both garments are cut and sewn from the same pattern and specs, with other cells (toile-mesh --scale). "
            "Every "
            "vertex finds its triangle in the other garment by panel coordinates and takes its place from there; sides "
            "of seams that are closed there stay together. So a garment is draped on a coarse grid, where that is "
            "cheap, and goes on from there on a fine one. The other garment may be the finer one, too: that gives the "
            "coarse one the fine one's shape. The summary tells how far vertices lie beyond the border of the coarse "
            "panels, the largest edge strains, how far the sides of seams moved to meet, and intersections. "
            "docs/tailoring.md says how it is done.",
        .inputs =
            {{.name = "garment",
              .doc = "sewn or layered garment that gets positions",
              .kind = stage::FileKind::garment},
             {.name = "coarse",
              .doc = "the same garment on another grid, placed or draped",
              .kind = stage::FileKind::garment},
             {.name = "support", .doc = "body to stay clear of", .kind = stage::FileKind::support, .required = false}},
        .output = stage::FileKind::garment};
  }

  static Result<stage::Output> run(const Params& params, stage::Run& run) {
    TOILE_TRY(const mesh::GarmentMesh fine, run.garment("garment"));
    TOILE_TRY(const mesh::GarmentMesh coarse, run.garment("coarse"));
    std::optional<mesh::SupportMesh> support;
    if (run.has("support")) {
      TOILE_TRY(support, run.support("support"));
    }
    auto refined = tailor::refine(fine, coarse, params.interpolation);
    if (!refined) {
      Issues issues = refined.issues();
      for (Issue& issue : issues) issue.place.file = run.path("garment");
      return issues;
    }
    mesh::GarmentMesh& garment = refined->garment;
    run.report("vertices", static_cast<std::size_t>(garment.vertex_count()));
    run.report("from_vertices", static_cast<std::size_t>(coarse.vertex_count()));
    run.report("vertices_outside", refined->outside);
    run.report("farthest_outside", refined->farthest, "m");
    if (refined->farthest_vertex >= 0)
      run.report("farthest_outside_at", tailor::place_text(garment, refined->farthest_vertex));
    run.report("particles_joined", refined->joined);
    run.report("widest_join", refined->widest_join, "m");
    run.report("open_seams", refined->open_seams);

    const Cloth cloth(garment, refined->seam_closed);
    if (support) {
      const contact::Surface surface = contact::make_surface(static_cast<int>(support->x.rows()), support->faces);
      const contact::SupportField field(surface, support->x);
      const contact::PushedOut pushed =
          contact::project_outside(field, cloth.surface, cloth.positions(garment), params.clearance);
      if (pushed.moved > 0) cloth.place(garment, pushed.x);
      run.report("vertices_inside", pushed.inside_before);
      run.report("vertices_moved_out", pushed.moved);
      run.report("largest_move_out", pushed.largest_move, "m");
    }
    auto cuts = contact::self_intersections(cloth.surface, cloth.positions(garment));
    run.report("self_intersections_found", cuts.size());
    if (!cuts.empty() && params.untangle) {
      const contact::Untangled untangled = contact::untangle(cloth.surface, cloth.positions(garment));
      cloth.place(garment, untangled.x);
      cuts = contact::self_intersections(cloth.surface, untangled.x);
      run.report("untangling_moved", untangled.largest_move, "m");
    }
    run.report("self_intersections", cuts.size());
    if (support) {
      const contact::Surface surface = contact::make_surface(static_cast<int>(support->x.rows()), support->faces);
      run.report("support_intersections",
                 contact::support_intersections(cloth.surface, cloth.positions(garment), surface, support->x).size());
    }
    const tailor::EdgeStrain strain = tailor::edge_strain(garment), before = tailor::edge_strain(coarse);
    run.report("largest_edge_strain", strain.longest);
    run.report("largest_edge_strain_at", tailor::place_text(garment, strain.longest_vertex));
    run.report("smallest_edge_strain", strain.shortest);
    run.report("smallest_edge_strain_at", tailor::place_text(garment, strain.shortest_vertex));
    run.report("rms_edge_strain", strain.rms);
    run.report("coarse_largest_edge_strain", before.longest);
    run.report("coarse_smallest_edge_strain", before.shortest);
    run.report("coarse_rms_edge_strain", before.rms);
    if (!cuts.empty()) {
      run.warn({"self_intersection",
                {.item = tailor::place_text(garment, garment.faces(cuts.front().a, 0))},
                fmt::format("the cloth cuts itself here ({} pairs of triangles in all)", cuts.size()),
                "refine by a smaller factor, or from a garment that has come to rest",
                Category::check});
    }
    stage::Output output{std::move(garment), {}, {}};
    if (!params.map.empty()) output.side_files.push_back({params.map, csv(refined->map, coarse)});
    return output;
  }
};

}  // namespace

int main(int argc, char** argv) {
  return toile::stage::run_main<RefineStage>(argc, argv);
}
