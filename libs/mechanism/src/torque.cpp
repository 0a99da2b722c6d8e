#include "toile/mechanism/torque.h"

#include "toile/base/text.h"

#include <algorithm>
#include <optional>

namespace toile::mechanism {

double driver_torque(const Configuration& configuration, const std::vector<Wrench>& wrenches) {
  TOILE_CHECK(wrenches.size() == configuration.rates.size(), "{} wrenches, {} bodies", wrenches.size(), configuration.rates.size());
  double power = 0;
  for (std::size_t b = 0; b < wrenches.size(); ++b) {
    // As in in_space: shift (z, y); forward to up is a turn about -x.
    const Pose& rate = configuration.rates[b];
    power += wrenches[b].force.dot(Eigen::Vector3d(0, rate.shift.y(), rate.shift.x())) - wrenches[b].torque.x() * rate.angle;
  }
  return power;
}

Result<WrenchRecord> read_wrenches(std::string_view csv, const std::string& file, const Linkage& linkage) {
  Issues issues;
  const auto bad = [&](int line, std::string what, const char* remedy) {
    if (issues.size() < 20) issues.push_back(Issue{"bad_record", {.file = file, .line = line}, std::move(what), remedy});
  };
  const std::vector<std::string> lines = split(csv, '\n');
  const std::vector<std::string> head = split(trim(lines.front()), ',');
  const auto column = [&](const std::string& name) -> std::optional<std::size_t> {
    const auto it = std::find(head.begin(), head.end(), name);
    return it == head.end() ? std::nullopt : std::optional(static_cast<std::size_t>(it - head.begin()));
  };
  const std::optional<std::size_t> time = column("time_s");
  std::vector<std::optional<std::array<std::size_t, 6>>> of_body;
  bool any = false;
  for (const std::string& body : linkage.bodies) {
    std::array<std::size_t, 6> found{};
    bool all = true;
    constexpr std::array names{"force_x_N", "force_y_N", "force_z_N", "torque_x_Nm", "torque_y_Nm", "torque_z_Nm"};
    for (std::size_t k = 0; k < 6; ++k) {
      const std::optional<std::size_t> c = column(body + "." + names[k]);
      all = all && c;
      if (c) found[k] = *c;
    }
    of_body.push_back(all ? std::optional(found) : std::nullopt);
    any = any || all;
  }
  if (!time || !any) {
    bad(1, "has no column time_s, or no forces on any body of the linkage", "give the record of toile-simulate, run with the linkage's motion");
    return issues;
  }
  WrenchRecord record;
  for (std::size_t i = 1; i < lines.size(); ++i) {
    const std::string_view line = trim(lines[i]);
    if (line.empty()) continue;
    const std::vector<std::string> cells = split(line, ',');
    if (cells.size() != head.size()) {
      bad(static_cast<int>(i) + 1, fmt::format("has {} cells, the header {}", cells.size(), head.size()), "give the record as it was written");
      continue;
    }
    const auto number = [&](std::size_t c) {
      const std::optional<double> value = parse_number(trim(cells[c]));
      if (!value) bad(static_cast<int>(i) + 1, fmt::format("'{}' is no number", trim(cells[c])), "give the record as it was written");
      return value.value_or(0);
    };
    record.times.push_back(number(*time));
    std::vector<Wrench> row(linkage.bodies.size());
    for (std::size_t b = 0; b < row.size(); ++b) {
      if (!of_body[b]) continue;
      const auto& c = *of_body[b];
      row[b].force = {number(c[0]), number(c[1]), number(c[2])};
      row[b].torque = {number(c[3]), number(c[4]), number(c[5])};
    }
    record.rows.push_back(std::move(row));
  }
  if (issues.empty() && record.times.empty()) bad(1, "has no rows", "give the record of a run that took steps");
  if (!issues.empty()) return issues;
  return record;
}

}  // namespace toile::mechanism
