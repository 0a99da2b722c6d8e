#include "seam_sides.h"

#include "toile/base/text.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

namespace toile::tailor {
namespace {

using mesh::GarmentMesh;

constexpr double rounding = 1e-9;

std::string side_name(int side) { return side == 0 ? "a" : side == 1 ? "b" : fmt::format("more {}", side - 1); }

const std::vector<std::string>& side_list(const SeamSpec& spec, int side) {
  return side == 0 ? spec.a : side == 1 ? spec.b : spec.more[static_cast<std::size_t>(side - 2)];
}

/// The places along a side that are meant, in order: where a closed chain begins it ends, too.
std::vector<SidePlace> places_on_side(const std::vector<PlanRun>& runs, const SeamSides& seam, int side, const PanelPlace& place) {
  std::vector<SidePlace> found;
  double start = 0;
  const auto& parts = seam.sides[static_cast<std::size_t>(side)];
  for (std::size_t k = 0; k < parts.size(); ++k) {
    const RunPart& part = parts[k];
    const std::size_t before = found.size();
    const auto consider = [&](double s) {
      if (s < part.from.s - rounding || s > part.to.s + rounding) return;
      const double at = std::clamp(s, part.from.s, part.to.s);
      found.push_back({side, static_cast<int>(k), at, place.vertex, start + (part.reversed ? part.to.s - at : at - part.from.s)});
    };
    if (place.run < 0) {
      for (const auto& vertex : runs[static_cast<std::size_t>(part.run)].row) {
        if (vertex.id == place.vertex) consider(vertex.s);
      }
    } else if (place.run == part.run) {
      consider(place.s);
    }
    std::sort(found.begin() + static_cast<std::ptrdiff_t>(before), found.end(), [](const SidePlace& p, const SidePlace& q) { return p.along < q.along; });
    start += part.length();
  }
  return found;
}

std::optional<SidePlace> place_on_side(const std::vector<PlanRun>& runs, const SeamSides& seam, int side, const PanelPlace& place) {
  const auto found = places_on_side(runs, seam, side, place);
  return found.empty() ? std::nullopt : std::optional(found.front());
}

/// The two ends of a zone in sewing order. Of a place that is passed twice the passage counts that lets `from` come before `to`.
std::optional<std::pair<SidePlace, SidePlace>> zone_on_side(const std::vector<PlanRun>& runs, const SeamSides& seam, int side, const PanelPlace& from, const PanelPlace& to) {
  const auto begins = places_on_side(runs, seam, side, from), ends = places_on_side(runs, seam, side, to);
  for (const SidePlace& p : begins) {
    for (const SidePlace& q : ends) {
      if (p.along < q.along) return std::pair(p, q);
    }
  }
  if (begins.empty() || ends.empty()) return std::nullopt;
  return std::pair(ends.front(), begins.front());
}

}  // namespace

Issue seam_issue(const SeamSpec& seam, std::string code, std::string what, std::string remedy) {
  return Issue{std::move(code), {.item = "seam " + seam.name}, std::move(what), std::move(remedy), Category::check};
}

std::string side_text(const SeamSpec& seam, int side) { return fmt::format("side {} ({})", side_name(side), fmt::join(side_list(seam, side), " ")); }

std::string seam_row_name(const SeamSpec& seam, int side) { return side <= 1 ? seam.name : fmt::format("{}_side_{}", seam.name, side + 1); }

double allowed_difference(const SeamSpec& seam, double length_a, double length_b, const SewParams& params) {
  const double longer = std::max(length_a, length_b), shorter = std::min(length_a, length_b);
  return std::max({always_allowed, std::min(params.tolerance * longer, params.tolerance_max), seam.ease.value_or(0), (seam.gather.value_or(1) - 1) * shorter});
}

ResolvedSides resolve_sides(const GarmentMesh& garment, const std::vector<PlanRun>& runs, const std::vector<const SeamSpec*>& specs) {
  ResolvedSides result;
  Issues& issues = result.issues;
  std::set<std::string> names;
  for (const SeamSpec* spec : specs) {
    SeamSides seam;
    seam.spec = spec;
    const auto complain = [&](Issue issue) {
      issue.place.item = "seam " + spec->name;
      issues.push_back(std::move(issue));
    };
    const int sides = 2 + static_cast<int>(spec->more.size());
    bool complete = true;
    for (int side = 0; side < sides; ++side) {
      auto& parts = seam.sides.emplace_back();
      double length = 0;
      if (side > 0 && !names.insert(seam_row_name(*spec, side)).second) complain({"duplicate_name", {}, side == 1 ? "two seams have this name" : fmt::format("its further side would be called {}, as another seam is", seam_row_name(*spec, side)), "rename one"});
      if (side_list(*spec, side).empty()) complain({"empty_seam", {}, fmt::format("side {} names no edge", side_name(side)), "name at least one: panel.edge"}), complete = false;
      for (const std::string& text : side_list(*spec, side)) {
        auto found = find_parts(garment, text);
        if (!found) {
          for (const Issue& issue : found.issues()) complain(issue);
          complete = false;
          continue;
        }
        for (const RunPart& part : *found) parts.push_back(part), length += part.length();
      }
      seam.lengths.push_back(length);
    }
    const auto find = [&](const std::string& text) -> std::optional<PanelPlace> {
      const auto place = find_place(garment, text);
      if (place) return *place;
      for (const Issue& issue : place.issues()) complain(issue);
      complete = false;
      return std::nullopt;
    };
    const auto first_side = [&](const PanelPlace& place, int from, int to) {
      std::optional<SidePlace> found;
      for (int side = from; side < to && !found; ++side) found = place_on_side(runs, seam, side, place);
      return found;
    };
    for (const MatchPoint& match : spec->match) {
      const auto a = find(match.a), b = find(match.b);
      if (!a || !b || !complete) continue;
      const auto on_a = first_side(*a, 0, 1), on_b = first_side(*b, 1, sides);
      if (!on_a) issues.push_back(seam_issue(*spec, "bad_match", fmt::format("the match point '{}' is not on {}", match.a, side_text(*spec, 0)), "name a place on the edges that are sewn"));
      if (!on_b) issues.push_back(seam_issue(*spec, "bad_match", fmt::format("the match point '{}' is not on {}{}", match.b, side_text(*spec, 1), sides > 2 ? " or a further side" : ""), "name a place on the edges that are sewn"));
      if (on_a && on_b) seam.matches.push_back({*on_a, *on_b});
    }
    for (const EaseZone& zone : spec->ease_at) {
      const auto from = find(zone.from), to = find(zone.to);
      if (!from || !to || !complete) continue;
      bool found = false;
      for (int side = 0; side < sides && !found; ++side) {
        const auto ends = zone_on_side(runs, seam, side, *from, *to);
        if (!ends) continue;
        found = true;
        if (ends->second.along - ends->first.along < always_allowed) issues.push_back(seam_issue(*spec, "bad_ease", fmt::format("from '{}' to '{}' is no stretch of its side", zone.from, zone.to), "name two different places"));
        else seam.zones.push_back({ends->first, ends->second, zone.share});
      }
      if (!found) issues.push_back(seam_issue(*spec, "bad_ease", fmt::format("'{}' and '{}' are not on one side of the seam", zone.from, zone.to), "name two places on the edges of one side"));
    }
    if (complete) result.seams.push_back(std::move(seam));
  }
  return result;
}

Issues check_sides(const GarmentMesh& garment, const std::vector<PlanRun>& runs, const std::vector<SeamSides>& seams, const SewParams& params) {
  Issues issues;
  struct Use {
    int seam, side;
    const RunPart* part;
  };
  std::vector<std::vector<Use>> uses(runs.size());
  for (std::size_t k = 0; k < seams.size(); ++k) {
    const SeamSides& seam = seams[k];
    const SeamSpec& spec = *seam.spec;
    std::vector<int> sense(seam.sides.size(), 0);
    bool mixed = false;
    for (int side = 0; side < static_cast<int>(seam.sides.size()); ++side) {
      const auto at = static_cast<std::size_t>(side);
      if (side > 0) {
        const double a = seam.lengths[0], b = seam.lengths[at];
        const double allowed = allowed_difference(spec, a, b, params);
        if (std::abs(a - b) > allowed * (1 + 1e-9)) {
          const double ratio = std::max(a, b) / std::min(a, b);
          std::string remedy = fmt::format("declare `ease: {:.2f} mm`", std::ceil(std::abs(a - b) * 1e5) / 100);
          if (ratio > 1.15 && ratio <= 3) remedy += fmt::format(" or `gather: {:.2f}`", std::ceil(ratio * 100) / 100);
          issues.push_back(seam_issue(spec, "seam_length",
                                      fmt::format("{} is {:.2f} mm, {} is {:.2f} mm: side {} is longer by {:.2f} mm, {:.2f} mm are allowed", side_text(spec, 0), a * 1e3, side_text(spec, side), b * 1e3, side_name(a > b ? 0 : side), std::abs(a - b) * 1e3, allowed * 1e3),
                                      remedy + " if it is meant, otherwise correct the pattern"));
        }
      }
      for (const RunPart& part : seam.sides[at]) {
        int own = runs[static_cast<std::size_t>(part.run)].sense;
        if (part.reversed) own = -own;
        for (const Use& use : uses[static_cast<std::size_t>(part.run)]) {
          if (use.seam == static_cast<int>(k) && std::min(use.part->to.s, part.to.s) - std::max(use.part->from.s, part.from.s) > 1e-6) {
            issues.push_back(seam_issue(spec, "same_edge", fmt::format("{} occurs twice", part_text(garment, part)), "a seam joins different edges or parts of an edge that do not overlap: give ranges, panel.edge(from..to)"));
          }
        }
        uses[static_cast<std::size_t>(part.run)].push_back({static_cast<int>(k), side, &part});
        if (own == 0) continue;
        if (sense[at] != 0 && sense[at] != own) {
          issues.push_back(seam_issue(spec, "twisted_seam", fmt::format("{} runs against the others of its side", part_text(garment, part)), "put '-' before it, or take it away"));
          mixed = true;
        }
        sense[at] = own;
      }
    }
    if (mixed || sense[0] == 0 || sense[1] == 0) continue;
    if (!spec.same_direction && sense[0] == sense[1]) {
      issues.push_back(seam_issue(spec, "twisted_seam", fmt::format("the two sides run the same way round their panels: the cloth would be twisted by half a turn ({:.2f} mm on {:.2f} mm)", seam.lengths[0] * 1e3, seam.lengths[1] * 1e3),
                                  "run one side backwards: '-' before each of its edges, in reverse order"));
    } else if (spec.same_direction && sense[0] != sense[1]) {
      issues.push_back(seam_issue(spec, "twisted_seam", "the two sides run against each other, though it says same_direction", "leave same_direction out, or run one side the other way"));
    }
  }
  // Ranges of two seams that overlap in part, and the cloth on the other side is the same: a slip, since one cloth would be
  // sewn twice to the same place. (Different cloths may overlap: a collar and a facing on one neckline.)
  const auto partners = [&](const Use& use) {
    std::set<int> panels;
    const SeamSides& seam = seams[static_cast<std::size_t>(use.seam)];
    for (std::size_t side = 0; side < seam.sides.size(); ++side) {
      if (static_cast<int>(side) == use.side) continue;
      for (const RunPart& part : seam.sides[side]) panels.insert(garment.runs[static_cast<std::size_t>(part.run)].panel);
    }
    return panels;
  };
  for (const auto& list : uses) {
    for (std::size_t i = 0; i < list.size(); ++i) {
      for (std::size_t j = i + 1; j < list.size(); ++j) {
        const RunPart &p = *list[i].part, &q = *list[j].part;
        if (list[i].seam == list[j].seam) continue;
        const double overlap = std::min(p.to.s, q.to.s) - std::max(p.from.s, q.from.s);
        const auto nested = [](const RunPart& inner, const RunPart& outer) { return inner.from.s >= outer.from.s - always_allowed && inner.to.s <= outer.to.s + always_allowed; };
        if (overlap <= always_allowed || nested(p, q) || nested(q, p)) continue;
        const std::set<int> of_i = partners(list[i]), of_j = partners(list[j]);
        std::vector<int> common;
        std::set_intersection(of_i.begin(), of_i.end(), of_j.begin(), of_j.end(), std::back_inserter(common));
        if (common.empty()) continue;
        issues.push_back(seam_issue(*seams[static_cast<std::size_t>(list[j].seam)].spec, "sewn_twice",
                                    fmt::format("{} and {} of seam {} overlap by {:.2f} mm, both sewn to {}", part_text(garment, q), part_text(garment, p), seams[static_cast<std::size_t>(list[i].seam)].spec->name, overlap * 1e3, garment.panels[static_cast<std::size_t>(common.front())].name),
                                    "let one range begin where the other ends"));
      }
    }
  }
  return issues;
}

}  // namespace toile::tailor
