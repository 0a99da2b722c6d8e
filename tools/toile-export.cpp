#include "toile/base/text.h"
#include "toile/inspect/artefact.h"
#include "toile/io/export.h"
#include "toile/stage/stage.h"

#include <optional>

using namespace toile;

namespace {

enum class Format { by_name, obj, gltf, glb, vtp };

struct Params {
  Format format = Format::by_name;
  io::SeamPoints seams = io::SeamPoints::separate;
  io::VtpEncoding encoding = io::VtpEncoding::raw;
  static void describe(auto& f) {
    f(&Params::format, {.key = "format", .doc = "file format; by_name takes it from the output's extension"});
    f(&Params::seams, {.key = "seams", .doc = "OBJ: whether sewn points stay separate or become one"});
    f(&Params::encoding, {.key = "encoding", .doc = "VTP: numbers as raw bytes or as text"});
  }
};

}  // namespace

template <>
struct toile::Choices<Format> {
  static constexpr std::array names{std::pair{"by_name", Format::by_name}, std::pair{"obj", Format::obj}, std::pair{"gltf", Format::gltf}, std::pair{"glb", Format::glb}, std::pair{"vtp", Format::vtp}};
};
template <>
struct toile::Choices<io::SeamPoints> {
  static constexpr std::array names{std::pair{"separate", io::SeamPoints::separate}, std::pair{"merged", io::SeamPoints::merged}};
};
template <>
struct toile::Choices<io::VtpEncoding> {
  static constexpr std::array names{std::pair{"raw", io::VtpEncoding::raw}, std::pair{"ascii", io::VtpEncoding::ascii}};
};

namespace {

struct ExportStage {
  using Params = ::Params;

  static stage::Description description() {
    return {.name = "toile-export",
            .version = 1,
            .summary = "Writes a garment or a support for other programs: OBJ, glTF 2.0, VTP.",
            .example = "toile-export draped.ply -o draped.glb",
            .details = "docs/export.md says what each format carries.",
            .inputs = {{"garment", "garment or support", stage::FileKind::any},
                       {"support", "glTF: what it is worn on, into the same file", stage::FileKind::support, false},
                       {"frames", "glTF: the garment through time (.mdd of toile-simulate), as an animation", stage::FileKind::any, false},
                       {"support_frames", "glTF: the support at the same times", stage::FileKind::any, false}},
            .output = stage::FileKind::any};
  }

  template <class Mesh>
  static std::string formatted(const Mesh& mesh, Format format, const Params& params) {
    switch (format) {
      case Format::gltf: return io::format_gltf(mesh, io::GltfContainer::json);
      case Format::glb: return io::format_gltf(mesh, io::GltfContainer::binary);
      case Format::vtp: return io::format_vtp(mesh, params.encoding);
      default: break;
    }
    if constexpr (std::is_same_v<Mesh, mesh::GarmentMesh>) return io::format_obj(mesh, params.seams);
    else return io::format_obj(mesh);
  }

  /// With what it is worn on, or moving.
  static Result<stage::Output> animated(const mesh::GarmentMesh& garment, Format format, stage::Run& run) {
    Issues issues;
    const bool gltf = format == Format::gltf || format == Format::glb;
    if (!gltf) issues.push_back({"bad_combination", {.item = "format"}, "only glTF takes a support and frames", "write NAME.glb or NAME.gltf", Category::usage});
    std::optional<mesh::SupportMesh> support;
    if (run.has("support")) {
      auto read = run.support("support");
      if (read) support = std::move(*read);
      else append(issues, read.issues());
    }
    const auto frames_of = [&](const char* port, Eigen::Index points) {
      std::optional<io::FrameSequence> frames;
      if (!run.has(port)) return frames;
      auto read = io::parse_mdd(*run.bytes(port), run.path(port));
      if (!read) {
        append(issues, read.issues());
      } else if (read->points.empty() || read->points.front().rows() != points) {
        issues.push_back({"bad_frames", {.file = run.path(port)}, fmt::format("has {} frames of {} points, the mesh has {}", read->points.size(), read->points.empty() ? 0 : read->points.front().rows(), points), "give the frames of this mesh"});
      } else {
        frames = std::move(*read);
      }
      return frames;
    };
    const auto garment_frames = frames_of("frames", garment.x.rows()), support_frames = frames_of("support_frames", support ? support->x.rows() : 0);
    if (run.has("support_frames") && (!garment_frames || (support_frames && support_frames->times != garment_frames->times))) {
      issues.push_back({"bad_frames", {.file = run.path("support_frames")}, "its times are not those of the garment's frames", "give `frames` and `support_frames` of one run"});
    }
    if (!issues.empty()) return issues;
    if (garment_frames) run.report("frames", garment_frames->times.size());
    const io::Animation animation{garment_frames ? &*garment_frames : nullptr, support_frames ? &*support_frames : nullptr};
    return stage::Output{io::format_gltf(garment, support ? &*support : nullptr, animation, format == Format::glb ? io::GltfContainer::binary : io::GltfContainer::json), {}, {}};
  }

  static Result<stage::Output> run(const Params& params, stage::Run& run) {
    Format format = params.format;
    if (format == Format::by_name) {
      const std::string& path = run.output_path();
      const auto dot = path.rfind('.');
      const std::string ending = dot == std::string::npos ? "" : path.substr(dot + 1);
      std::vector<std::string> known;
      for (const auto& [name, value] : Choices<Format>::names) {
        if (value == Format::by_name) continue;
        known.emplace_back(name);
        if (ending == name) format = value;
      }
      if (format == Format::by_name) {
        return Issue{"unknown_format", {.file = path}, fmt::format("the extension '{}' names no format", ending), suggestion(ending, known) + " or say --format", Category::usage};
      }
    }
    const auto bytes = run.bytes("garment");
    if (!bytes) return bytes.issues();
    if (inspect::artefact_kind(*bytes) == inspect::Artefact::support) {
      const auto support = run.support("garment");
      if (!support) return support.issues();
      run.report("faces", static_cast<std::size_t>(support->faces.rows()));
      return stage::Output{formatted(*support, format, params), {}, {}};
    }
    const auto garment = run.garment("garment");
    if (!garment) return garment.issues();
    run.report("faces", static_cast<std::size_t>(garment->face_count()));
    if (run.has("support") || run.has("frames") || run.has("support_frames")) return animated(*garment, format, run);
    return stage::Output{formatted(*garment, format, params), {}, {}};
  }
};

}  // namespace

int main(int argc, char** argv) { return stage::run_main<ExportStage>(argc, argv); }
