// Moves a linkage and makes its surface.
#include "toile/io/record_yaml.h"
#include "toile/mechanism/frame.h"
#include "toile/stage/stage.h"

#include <algorithm>
#include <cmath>

namespace {

using namespace toile;

double degrees(double angle) { return angle * 180 / M_PI; }

enum class What { frame, skin };

}  // namespace

template <>
struct toile::Choices<What> {
  static constexpr std::array names{std::pair{"frame", What::frame}, std::pair{"skin", What::skin}};
};

namespace {

struct MechanismParams {
  What surface = What::frame;
  mechanism::SkinOptions skin;
  std::vector<double> times{0};
  std::vector<double> angles{0};
  mechanism::Profile profile = mechanism::Profile::smooth;
  double interval = 0.01;
  double at = 0;
  double closure = 1e-9;
  std::string motion;
  static void describe(auto& f) {
    f(&MechanismParams::surface, {.key = "surface", .doc = "frame: bars and bows; skin: cloth spread from bow to bow, as a closed shell from which toile-flatten takes a pattern"});
    f(&MechanismParams::skin, {.key = "skin", .doc = "how the skin lies"});
    f(&MechanismParams::times, {.key = "times", .doc = "times of the rows of `angles`, increasing", .unit = "s"});
    f(&MechanismParams::angles, {.key = "angles", .doc = "angle of the driver from the drawn position at each of these times", .unit = "rad"});
    f(&MechanismParams::profile, {.key = "profile", .doc = "between rows: straight, or smooth (3u^2 - 2u^3, at rest at each row)"});
    f(&MechanismParams::interval, {.key = "interval", .doc = "time between the rows of the table of the motion", .unit = "s", .min = 1e-6, .max = 1000});
    f(&MechanismParams::at, {.key = "at", .doc = "time of the position that is written", .unit = "s", .min = 0, .max = 1e6});
    f(&MechanismParams::closure, {.key = "closure", .doc = "a pivot whose two bodies are farther apart at any time is a finding", .unit = "m", .min = 1e-15, .max = 1});
    f(&MechanismParams::motion, {.key = "motion", .doc = "CSV file of the motion: time, body, shift x y z, quaternion w x y z, by which the body has gone from the drawn position; empty: none", .local = true});
    f.check([](const MechanismParams& p, Issues& issues) {
      if (p.times.empty() || p.times.size() != p.angles.size()) {
        issues.push_back(Issue{"bad_range", {.item = "angles"}, fmt::format("there are {} times and {} angles", p.times.size(), p.angles.size()), "give one angle for each time"});
      }
      if (std::adjacent_find(p.times.begin(), p.times.end(), [](double a, double b) { return b <= a; }) != p.times.end()) {
        issues.push_back(Issue{"bad_range", {.item = "times"}, "the times do not increase", "put them in order"});
      }
    });
  }
};

struct MechanismStage {
  using Params = MechanismParams;

  static stage::Description description() {
    return {.name = "toile-mechanism",
            .version = 1,
            .summary = "Makes the frame of a soft top, or another planar linkage, and its motion.",
            .example = "toile-mechanism samples/mechanisms/softtop.yaml -o frame.ply --motion motion.csv --times '[0 s, 1 s]' --angles '[0 deg, 110 deg]'",
            .details = "The linkage is drawn from the side: bodies, the pivots that join them, the body that a motor turns; bars and bows give it a surface. "
                       "It must have one degree of freedom. The result is the frame's surface (a region a body, landmarks along the bows) at the time `at`; "
                       "`motion` is the table of all bodies' positions through time. docs/mechanism.md says more.",
            .inputs = {{.name = "linkage", .doc = "bodies, pivots, bars and bows (YAML)", .kind = stage::FileKind::spec}},
            .output = stage::FileKind::support};
  }

  static Result<stage::Output> run(const Params& params, stage::Run& run) {
    TOILE_TRY(const std::string text, run.bytes("linkage"));
    const std::string file = run.path("linkage");
    TOILE_TRY(const mechanism::Linkage linkage, io::read_record<mechanism::Linkage>(text, file));
    const auto placed = [&file](Issues issues) {
      for (Issue& issue : issues) {
        if (issue.place.file.empty()) issue.place.file = file;
      }
      return issues;
    };
    if (Issues issues = mechanism::validate(linkage); !issues.empty()) return placed(std::move(issues));
    auto frame = mechanism::frame_surface(linkage);
    if (!frame) return placed(frame.issues());

    std::vector<double> times, angles;
    const double first = params.times.front(), last = params.times.back();
    const auto rows = static_cast<std::size_t>(std::max(0.0, std::ceil((last - first) / params.interval - 1e-9)));
    for (std::size_t i = 0; i <= rows; ++i) times.push_back(i == rows ? last : first + static_cast<double>(i) * params.interval);
    times.push_back(params.at);
    for (const double t : times) angles.push_back(mechanism::angle_at(params.times, params.angles, params.profile, t));
    auto followed = mechanism::follow(linkage, angles);
    if (!followed) return placed(followed.issues());

    stage::Output output;
    double closure = 0, conditioning = 1;
    for (const mechanism::Configuration& c : *followed) {
      closure = std::max(closure, c.closure);
      conditioning = std::min(conditioning, c.conditioning);
    }
    if (closure > params.closure) {
      output.findings.push_back(Issue{.code = "open_loop", .place = {.file = file, .item = "pivots"}, .what = fmt::format("a pivot's two bodies are up to {:.3g} m apart", closure),
                                      .remedy = "allow more with `closure`", .category = Category::check});
    }
    if (!params.motion.empty()) {
      std::string table = "time,body,x,y,z,qw,qx,qy,qz\n";
      for (std::size_t i = 0; i + 1 < followed->size(); ++i) {
        for (std::size_t b = 0; b < linkage.bodies.size(); ++b) {
          const mechanism::RigidPose p = mechanism::in_space((*followed)[i].poses[b]);
          table += fmt::format("{},{},{},{},{},{},{},{},{}\n", times[i], linkage.bodies[b], p.shift[0], p.shift[1], p.shift[2], p.rotation[0], p.rotation[1], p.rotation[2], p.rotation[3]);
        }
      }
      output.side_files.push_back({params.motion, std::move(table)});
    }
    run.report("bodies", linkage.bodies.size());
    run.report("pivots", linkage.pivots.size());
    run.report("vertices", static_cast<std::size_t>(frame->x.rows()));
    run.report("faces", static_cast<std::size_t>(frame->faces.rows()));
    run.report("rows", rows + 1);
    run.report("largest_closure_error", closure, "m");
    run.report("least_conditioning", conditioning);
    const mechanism::Configuration& end = followed->back();
    for (std::size_t b = 0; b < linkage.bodies.size(); ++b) run.report("angle_" + linkage.bodies[b], degrees(end.poses[b].angle), "deg");
    if (params.surface == What::skin) {
      auto skin = mechanism::skin_surface(linkage, end.poses, params.skin);
      if (!skin) return placed(skin.issues());
      run.report("skin_vertices", static_cast<std::size_t>(skin->x.rows()));
      output.artefact = std::move(*skin);
    } else {
      output.artefact = mechanism::moved(*frame, linkage, end);
    }
    return output;
  }
};

}  // namespace

int main(int argc, char** argv) { return toile::stage::run_main<MechanismStage>(argc, argv); }
