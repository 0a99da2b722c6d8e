// Takes in a body made elsewhere.
#include "toile/io/body_import.h"
#include "toile/placement/segment.h"
#include "toile/stage/stage.h"

#include <Eigen/Geometry>
#include <vector>

namespace {

using namespace toile;

/// Area of each named region [m2].
std::vector<double> region_areas(const mesh::SupportMesh& body) {
  std::vector<double> areas(body.region_names.size(), 0.0);
  for (Eigen::Index f = 0; f < body.faces.rows(); ++f) {
    const Eigen::Vector3d a = body.x.row(body.faces(f, 0)), b = body.x.row(body.faces(f, 1)), c = body.x.row(body.faces(f, 2));
    if (body.face_region[f] >= 0) areas[static_cast<std::size_t>(body.face_region[f])] += (b - a).cross(c - a).norm() / 2;
  }
  return areas;
}

struct BodyStage {
  using Params = io::BodyImportParams;

  static stage::Description description() {
    return {.name = "toile-body",
            .version = 3,
            .summary = "Takes in a body or another support from a mesh file (OBJ, STL, PLY, glTF and others).",
            .example = "toile-body scan.stl -o body.ply --unit mm --up z --facing -y",
            .details = "The result is in metres, y up, facing +z. Unit and axes are as stated, never guessed; an implausible size is an error that says "
                       "which unit would fit. Vertices of exactly equal position become one. The surface has to be closed, with all faces looking outward "
                       "(or ask for winding: outward), unless wrap asks for a closed surface round it. Landmarks and regions are what "
                       "`landmarks` and `regions` name; `segment: body` finds trunk, neck, arms and legs of what is left.",
            .inputs = {{.name = "body", .doc = "mesh file", .kind = stage::FileKind::any}},
            .output = stage::FileKind::support};
  }

  static Result<stage::Output> run(const Params& params, stage::Run& run) {
    TOILE_TRY(io::ImportedBody body, io::import_body(run.path("body"), params));
    if (params.segment == io::Segmentation::body) {
      Issues issues = placement::segment(body.mesh);
      for (Issue& issue : issues) issue.place = {.file = run.path("body"), .item = "segment"};
      if (!issues.empty()) return issues;
    }
    run.report("vertices", static_cast<std::size_t>(body.mesh.x.rows()));
    run.report("faces", static_cast<std::size_t>(body.mesh.faces.rows()));
    run.report("joined_corners", body.joined_corners);
    run.report("dropped_faces", body.dropped_faces);
    run.report("pieces", body.pieces.size());
    for (std::size_t i = 0; i < body.pieces.size() && i < 20; ++i) {
      const io::BodyPiece& p = body.pieces[i];
      run.report(fmt::format("piece_{}", i), fmt::format("{} vertices, {} faces, {:.6f} m3, x {:.3f}..{:.3f} y {:.3f}..{:.3f} z {:.3f}..{:.3f} m", p.vertices, p.faces,
                                                         p.volume, p.low[0], p.high[0], p.low[1], p.high[1], p.low[2], p.high[2]));
    }
    if (params.wrap > 0) {
      run.report("open_edges", body.open_edges);
      run.report("wrap_distance", body.wrap_distance, "m");
    }
    const auto size = (body.mesh.x.colwise().maxCoeff() - body.mesh.x.colwise().minCoeff()).eval();
    run.report("width", size[0], "m");
    run.report("height", size[1], "m");
    run.report("depth", size[2], "m");
    run.report("volume", mesh::volume(body.mesh.x, body.mesh.faces), "m3");
    const std::vector<double> areas = region_areas(body.mesh);
    for (std::size_t i = 0; i < areas.size(); ++i) run.report("area_" + body.mesh.region_names[i], areas[i], "m2");
    stage::Output output;
    output.artefact = std::move(body.mesh);
    return output;
  }
};

}  // namespace

int main(int argc, char** argv) { return toile::stage::run_main<BodyStage>(argc, argv); }
