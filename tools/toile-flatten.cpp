// Cuts a form or a garment's surface along named lines and lays the pieces flat.
#include "toile/io/pattern_yaml.h"
#include "toile/io/ply.h"
#include "toile/reshape/flatten.h"
#include "toile/stage/stage.h"

namespace {

using namespace toile;

struct FlattenStage {
  using Params = reshape::FlattenParams;

  static stage::Description description() {
    return {.name = "toile-flatten",
            .version = 1,
            .summary = "Cuts a form or a garment's surface along named lines and lays the pieces flat: a pattern.",
            .example = "toile-flatten form.ply --spec torso.yaml -o torso-pattern.yaml --seams seams.yaml --map map.ply",
            .details = "Lines are sections by planes, paths from point to point, or seams of the garment. Each piece that is asked for is laid flat with the "
                       "least stretch (as rigid as possible), turned to its grain and drawn with curves; edges are called by their lines and get notches "
                       "that match. Area change and strains are reported for every piece, with --json in full; over the limit a dart is proposed or "
                       "cut. `seams` writes the spec for toile-sew, `map` the pieces on the surface, from which `toile-place --start` puts the sewn "
                       "garment back. docs/reshaping.md says how.",
            .inputs = {{.name = "surface", .doc = "form (support) or garment", .kind = stage::FileKind::any}},
            .output = stage::FileKind::pattern};
  }

  static Result<stage::Output> run(const Params& params, stage::Run& run) {
    const auto bytes = run.bytes("surface");
    if (!bytes) return bytes.issues();
    const bool form = bytes->substr(0, 1000).find("\ncomment toile-support ") != std::string::npos;
    const auto flattened = [&]() -> Result<reshape::Flattened> {
      if (form) {
        TOILE_TRY(const mesh::SupportMesh support, run.support("surface"));
        return reshape::flatten(reshape::surface_of(support), params);
      }
      TOILE_TRY(const mesh::GarmentMesh garment, run.garment("surface"));
      return reshape::flatten(garment, params);
    }();
    const auto placed = [&](Issues issues) {
      for (Issue& issue : issues) {
        if (issue.place.file.empty()) issue.place.file = run.path("surface");
      }
      return issues;
    };
    if (!flattened) return placed(flattened.issues());
    double area = 0, squares = 0, worst = 0;
    for (const reshape::PieceReport& piece : flattened->pieces) {
      area += piece.area;
      squares += piece.area * piece.rms_strain * piece.rms_strain;
      worst = std::max(worst, piece.max_strain);
    }
    run.report("pieces", flattened->pieces.size());
    run.report("seams", flattened->seams.size());
    run.report("area", area, "m2");
    run.report("rms_strain", std::sqrt(squares / area));
    run.report("max_strain", worst);
    for (const reshape::PieceReport& piece : flattened->pieces) {
      const std::string key = "pieces." + piece.name + ".";
      run.report(key + "area", piece.area, "m2");
      run.report(key + "area_change", piece.area_change);
      run.report(key + "rms_strain", piece.rms_strain);
      run.report(key + "max_strain", piece.max_strain);
      if (run.json()) {
        run.report(key + "most_stretch", piece.most_stretch);
        run.report(key + "most_compression", piece.most_compression);
        run.report(key + "turned_faces", piece.turned_faces);
      }
      if (piece.darts_cut > 0) run.report(key + "darts_cut", piece.darts_cut);
      if (piece.dart) {
        const reshape::DartProposal& dart = *piece.dart;
        const auto point = [](const Eigen::Vector3d& p) { return fmt::format("({:.3f}, {:.3f}, {:.3f})", p.x(), p.y(), p.z()); };
        run.report(key + "dart.edge", dart.edge);
        run.report(key + "dart.mouth", point(dart.mouth));
        run.report(key + "dart.apex", point(dart.apex));
        run.report(key + "dart.length", 1e3 * dart.length, "mm");
        run.report(key + "dart.intake", 1e3 * dart.intake, "mm");
        run.report(key + "dart.rms_strain", dart.rms_strain);
        run.report(key + "dart.max_strain", dart.max_strain);
      }
    }
    stage::Output output{io::format_pattern(flattened->pattern), placed(flattened->findings), {}};
    if (!params.seams.empty()) output.side_files.push_back({params.seams, reshape::seam_spec(flattened->seams)});
    if (!params.map.empty()) output.side_files.push_back({params.map, io::format_garment(flattened->map, io::Encoding::binary)});
    return output;
  }
};

}  // namespace

int main(int argc, char** argv) { return toile::stage::run_main<FlattenStage>(argc, argv); }
