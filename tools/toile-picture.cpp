#include "toile/inspect/artefact.h"
#include "toile/inspect/picture.h"
#include "toile/stage/stage.h"

using namespace toile;

namespace {

struct PictureStage {
  using Params = inspect::PictureParams;

  static stage::Description description() {
    return {.name = "toile-picture",
            .version = 3,
            .summary = "Draws a garment, a body or both and writes a PNG picture.",
            .example = "toile-picture draped.ply --support form.ply -o front.png --view front",
            .details = "The first file may be a garment or a support alone. docs/pictures.md says how colours, lines and light are made.",
            .inputs = {{"garment", "garment, or a support alone", stage::FileKind::any}, {"support", "body or dress form", stage::FileKind::support, false}},
            .output = stage::FileKind::png};
  }

  static Result<stage::Output> run(const Params& params, stage::Run& run) {
    const auto bytes = run.bytes("garment");
    if (!bytes) return bytes.issues();
    std::optional<mesh::GarmentMesh> garment;
    std::optional<mesh::SupportMesh> support;
    if (run.has("support")) {
      auto read = run.support("support");
      if (!read) return read.issues();
      support = std::move(*read);
    }
    if (!support && inspect::artefact_kind(*bytes) == inspect::Artefact::support) {
      auto read = run.support("garment");
      if (!read) return read.issues();
      support = std::move(*read);
    } else {
      auto read = run.garment("garment");
      if (!read) return read.issues();
      garment = std::move(*read);
    }
    const auto image = inspect::draw_picture(params, garment ? &*garment : nullptr, support ? &*support : nullptr);
    if (!image) return image.issues();
    auto png = inspect::encode_png(*image);
    if (!png) return png.issues();
    run.report("width", image->width);
    run.report("height", image->height);
    return stage::Output{std::move(*png), {}, {}};
  }
};

}  // namespace

int main(int argc, char** argv) { return stage::run_main<PictureStage>(argc, argv); }
