#include "toile/dynamics/support_motion.h"

#include "toile/base/text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace toile::dynamics {
namespace {

constexpr double unit_tolerance = 1e-6;  // of a quaternion's length
constexpr double same_time = 1e-9;       // [s]

/// The screw that leads from a to b: p -> turn by angle about axis through centre, then slide along the axis.
struct Screw {
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX(), centre = Eigen::Vector3d::Zero(), slide = Eigen::Vector3d::Zero();
  double angle = 0;
};

Screw screw_between(const BodyPose& a, const BodyPose& b) {
  Eigen::Quaterniond turn = b.rotation * a.rotation.conjugate();
  if (turn.w() < 0) turn.coeffs() = -turn.coeffs();
  Screw screw;
  const double s = turn.vec().norm();
  screw.angle = 2 * std::atan2(s, turn.w());
  if (screw.angle < 1e-7) {
    screw.angle = 0;
    screw.slide = b.shift - a.shift;
    return screw;
  }
  screw.axis = turn.vec() / s;
  const Eigen::Vector3d d = b.shift - turn * a.shift;
  screw.slide = screw.axis * screw.axis.dot(d);
  const Eigen::Vector3d across = d - screw.slide;
  screw.centre = 0.5 * (across + turn.w() / s * screw.axis.cross(across));
  return screw;
}

BodyPose along(const BodyPose& a, const Screw& screw, double part) {
  if (screw.angle == 0) return {a.rotation, a.shift + part * screw.slide};
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(part * screw.angle, screw.axis));
  return {(turn * a.rotation).normalized(), turn * (a.shift - screw.centre) + screw.centre + part * screw.slide};
}

struct Track {
  std::vector<double> times;
  std::vector<BodyPose> poses;
};

class TableMotion final : public SupportMotion {
 public:
  TableMotion(std::vector<std::string> names, std::vector<Track> tracks, std::string file, double begin)
      : names_(std::move(names)), tracks_(std::move(tracks)), file_(std::move(file)), begin_(begin) {}

  const std::vector<std::string>& bodies() const override { return names_; }

  Result<SupportState> start(double duration) override {
    Issues issues;
    for (std::size_t b = 0; b < names_.size(); ++b) {
      const std::vector<double>& times = tracks_[b].times;
      if (times.front() > begin_ + same_time || times.back() < begin_ + duration - same_time) {
        issues.push_back(Issue{"motion_ends", {.file = file_, .item = "body " + names_[b]},
                               fmt::format("its rows are from {} to {} s, the simulation runs from {} to {} s", times.front(), times.back(), begin_, begin_ + duration),
                               "add rows, or change motion_begin or duration"});
      }
    }
    if (!issues.empty()) return issues;
    return at(0);
  }
  Result<SupportState> advance(double time, double step) override { return at(time + step); }
  Result<Verdict> finish(bool, const std::vector<BodyWrench>&) override { return Verdict::holds; }

 private:
  SupportState at(double time) const {
    SupportState state;
    state.time = time;
    for (const Track& track : tracks_) {
      const double t = std::clamp(begin_ + time, track.times.front(), track.times.back());
      if (track.times.size() == 1) {
        state.poses.push_back(track.poses.front());
        state.twists.emplace_back();
        continue;
      }
      const auto next = std::clamp<std::ptrdiff_t>(std::lower_bound(track.times.begin(), track.times.end(), t) - track.times.begin(), 1, static_cast<std::ptrdiff_t>(track.times.size()) - 1);
      const auto i = static_cast<std::size_t>(next);
      const double span = track.times[i] - track.times[i - 1], part = (t - track.times[i - 1]) / span;
      const Screw screw = screw_between(track.poses[i - 1], track.poses[i]);
      // A row itself to the last digit.
      const BodyPose pose = t == track.times[i] ? track.poses[i] : along(track.poses[i - 1], screw, part);
      BodyTwist twist;
      twist.angular = screw.angle / span * screw.axis;
      twist.linear = (screw.slide / span + twist.angular.cross(pose.shift - screw.centre));
      state.poses.push_back(pose);
      state.twists.push_back(twist);
    }
    return state;
  }

  std::vector<std::string> names_;
  std::vector<Track> tracks_;
  std::string file_;
  double begin_;
};

class ShapeMotion final : public SupportMotion {
 public:
  ShapeMotion(std::vector<double> times, std::vector<Points3> shapes) : times_(std::move(times)), shapes_(std::move(shapes)) {}

  const std::vector<std::string>& bodies() const override { return names_; }
  Result<SupportState> start(double duration) override {
    if (times_.back() < duration - same_time) {
      return Issue{"motion_ends", {.item = "shape_times"}, fmt::format("the shapes end at {} s, the simulation at {} s", times_.back(), duration), "add shapes, or shorten duration"};
    }
    return at(0);
  }
  Result<SupportState> advance(double time, double step) override { return at(time + step); }
  Result<Verdict> finish(bool, const std::vector<BodyWrench>&) override { return Verdict::holds; }

 private:
  SupportState at(double time) const {
    SupportState state;
    state.time = time;
    const double t = std::clamp(time, times_.front(), times_.back());
    std::size_t i = 1;
    while (i + 1 < times_.size() && times_[i] < t) ++i;
    const double part = (t - times_[i - 1]) / (times_[i] - times_[i - 1]);
    state.shape = part == 0 ? shapes_[i - 1] : (part == 1 ? shapes_[i] : Points3((1 - part) * shapes_[i - 1] + part * shapes_[i]));
    return state;
  }

  std::vector<std::string> names_;
  std::vector<double> times_;
  std::vector<Points3> shapes_;
};

}  // namespace

BodyPose between(const BodyPose& a, const BodyPose& b, double part) { return along(a, screw_between(a, b), part); }

Result<std::unique_ptr<SupportMotion>> table_motion(std::string_view csv, const std::string& file, double begin) {
  constexpr const char* header = "time,body,x,y,z,qw,qx,qy,qz";
  Issues issues;
  const auto bad = [&](int line, std::string what, const char* remedy) {
    if (issues.size() < 20) issues.push_back(Issue{"bad_table", {.file = file, .line = line}, std::move(what), remedy});
  };
  std::vector<std::string> names;
  std::vector<Track> tracks;
  int number = 0;
  bool headed = false;
  for (const std::string& text : split(csv, '\n')) {
    ++number;
    const std::string_view line = trim(text);
    if (line.empty() || line.front() == '#') continue;
    if (!headed) {
      headed = true;
      if (line != header) {
        bad(number, fmt::format("the header is '{}'", line.substr(0, 80)), "write time,body,x,y,z,qw,qx,qy,qz");
        break;
      }
      continue;
    }
    const std::vector<std::string> cells = split(line, ',');
    if (cells.size() != 9) {
      bad(number, fmt::format("has {} cells", cells.size()), "write time, body, x, y, z, qw, qx, qy, qz");
      continue;
    }
    std::array<double, 9> value{};
    bool fine = true;
    for (std::size_t c = 0; c < 9; ++c) {
      if (c == 1) continue;
      const std::optional<double> parsed = parse_number(trim(cells[c]));
      if (!parsed) {
        bad(number, fmt::format("'{}' is no number", trim(cells[c])), "write a finite number in SI units");
        fine = false;
        break;
      }
      value[c] = *parsed;
    }
    if (!fine) continue;
    BodyPose pose;
    pose.shift = {value[2], value[3], value[4]};
    pose.rotation = Eigen::Quaterniond(value[5], value[6], value[7], value[8]);
    if (std::abs(pose.rotation.norm() - 1) > unit_tolerance) {
      bad(number, fmt::format("the quaternion's length is {:.9g}", pose.rotation.norm()), "give a unit quaternion, w first");
      continue;
    }
    pose.rotation.normalize();
    const std::string name(trim(cells[1]));
    if (name.empty()) {
      bad(number, "the body has no name", "name a region of the support");
      continue;
    }
    const auto found = std::find(names.begin(), names.end(), name);
    const auto b = static_cast<std::size_t>(found - names.begin());
    if (found == names.end()) {
      names.push_back(name);
      tracks.emplace_back();
    }
    Track& track = tracks[b];
    if (!track.times.empty() && !(value[0] > track.times.back())) {
      bad(number, fmt::format("the times of body {} do not increase", name), "sort the rows; one row a body and time");
      continue;
    }
    track.times.push_back(value[0]);
    track.poses.push_back(pose);
  }
  if (issues.empty() && names.empty()) bad(number, "the table has no rows", "write a row for each body and time");
  if (!issues.empty()) return issues;
  return std::unique_ptr<SupportMotion>(std::make_unique<TableMotion>(std::move(names), std::move(tracks), file, begin));
}

Result<std::unique_ptr<SupportMotion>> shape_motion(std::vector<double> times, std::vector<Points3> shapes) {
  Issues issues;
  const auto bad = [&](std::string what, const char* remedy) { issues.push_back(Issue{"bad_table", {.item = "shape_times"}, std::move(what), remedy}); };
  if (times.size() != shapes.size() || times.size() < 2) {
    bad(fmt::format("there are {} times and {} shapes", times.size(), shapes.size()), "give a time for each shape, two at least");
  } else {
    if (std::abs(times.front()) > same_time) bad(fmt::format("the first shape is at {} s", times.front()), "begin at 0 s");
    for (std::size_t i = 1; i < times.size(); ++i) {
      if (!(times[i] > times[i - 1])) bad(fmt::format("time {} does not increase", i + 1), "sort the shapes");
      if (shapes[i].rows() != shapes[0].rows()) bad(fmt::format("shape {} has {} vertices, the first {}", i + 1, shapes[i].rows(), shapes[0].rows()), "give shapes of one mesh");
    }
  }
  if (!issues.empty()) return issues;
  return std::unique_ptr<SupportMotion>(std::make_unique<ShapeMotion>(std::move(times), std::move(shapes)));
}

}  // namespace toile::dynamics
