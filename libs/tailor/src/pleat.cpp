#include "toile/tailor/pleat.h"

#include "line_reference.h"
#include "seam_sides.h"

#include "toile/base/text.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

namespace toile::tailor {
namespace {

/// What a line of the other half of a piece cut on the fold is called.
constexpr const char* other_half = "_m";
constexpr double same_place = 1e-6;  ///< [m]

using mesh::GarmentMesh;

/// The end of a pleat's fold line on an edge.
struct FoldEnd {
  double s = 0;      ///< along the edge's run
  int run = 0;       ///< the fold line
  bool outer = true; ///< the visible fold
  bool first = true; ///< the fold line begins here
};

/// Cloth of the pleated side from one fold to the next.
struct Stretch {
  RunPart part;
  bool forward = true;
  double from = 0, to = 0;  ///< where it comes to lie, from <= to [m]
  bool after_outer = true;  ///< the fold before it is a visible one (where there is one)
};

bool is_pleat(const mesh::Fold& fold) { return fold.kind == "knife" || fold.kind == "box" || fold.kind == "inverted"; }

std::string run_name(const GarmentMesh& garment, int run) {
  const mesh::Run& row = garment.runs[static_cast<std::size_t>(run)];
  return garment.panels[static_cast<std::size_t>(row.panel)].name + "." + row.name;
}

/// A part as specs write it.
std::string text_of(const GarmentMesh& garment, const RunPart& part) {
  const double length = garment.runs[static_cast<std::size_t>(part.run)].length;
  std::string text = (part.reversed ? "-" : "") + run_name(garment, part.run);
  if (part.from.s <= 0 && part.to.s >= length) return text;
  return fmt::format("{}({} m..{} m)", text, format_number(std::max(part.from.s, 0.0)), format_number(std::min(part.to.s, length)));
}

class PleatedSeam {
 public:
  PleatedSeam(const GarmentMesh& garment, const SeamSpec& spec, const SewParams& params) : garment_(garment), spec_(spec), params_(params) {}

  Result<std::vector<SeamSpec>> expand() {
    if (!spec_.match.empty() || !spec_.more.empty() || !spec_.ease_at.empty() || spec_.gather) return issue("pleats_and_match", "a pleated seam takes no match points, gathers, ease zones or further sides", "its folds say what comes together; sew the rest as seams of their own");
    Issues issues;
    std::array<std::vector<RunPart>, 2> sides;
    std::array<std::size_t, 2> folds{0, 0};
    for (std::size_t side = 0; side < 2; ++side) {
      for (const std::string& text : side == 0 ? spec_.a : spec_.b) {
        const auto parts = find_parts(garment_, text);
        if (!parts) {
          for (Issue trouble : parts.issues()) {
            trouble.place.item = "seam " + spec_.name;
            issues.push_back(std::move(trouble));
          }
          continue;
        }
        for (const RunPart& part : *parts) {
          sides[side].push_back(part);
          folds[side] += fold_ends(part).size();
        }
      }
    }
    if (!issues.empty()) return issues;
    if (folds[0] == 0 && folds[1] == 0) return issue("no_pleats", "no pleat ends on its edges", "lay pleats along one of them in toile-mesh, or leave `pleated` out");
    if (folds[0] > 0 && folds[1] > 0) return issue("pleats_on_both_sides", "pleats end on both of its sides", "one side must be plain: sew them through a band, or match the pleats by seams of their own");
    pleated_ = folds[0] > 0 ? 0 : 1;
    plain_ = sides[1 - pleated_];
    if (Issues trouble = walk(sides[pleated_]); !trouble.empty()) return trouble;

    double plain_length = 0;
    for (const RunPart& part : plain_) plain_length += part.length();
    const double allowed = allowed_difference(spec_, visible_, plain_length, params_);
    if (std::abs(visible_ - plain_length) > allowed * (1 + 1e-9)) {
      return issue("seam_length", fmt::format("{} is {:.2f} mm with its pleats closed, {} is {:.2f} mm: they differ by {:.2f} mm, {:.2f} mm are allowed", fmt::join(pleated_ == 0 ? spec_.a : spec_.b, " "), visible_ * 1e3, fmt::join(pleated_ == 0 ? spec_.b : spec_.a, " "), plain_length * 1e3,
                                              std::abs(visible_ - plain_length) * 1e3, allowed * 1e3),
                   "correct the pleats or the pattern, or declare `ease`");
    }
    scale_ = plain_length / visible_;
    std::vector<SeamSpec> seams = stretches();
    const std::vector<SeamSpec> down = stitched_down();
    seams.insert(seams.end(), down.begin(), down.end());
    return seams;
  }

 private:
  Issue issue(std::string code, std::string what, std::string remedy) const { return {std::move(code), {.item = "seam " + spec_.name}, std::move(what), std::move(remedy), Category::check}; }

  /// Folds of pleats that end inside a part, in the direction of its use.
  std::vector<FoldEnd> fold_ends(const RunPart& part) const {
    std::map<int, double> on_run;
    for (const auto& row : garment_.run_vertices) {
      if (row.run == part.run) on_run.emplace(row.vertex, row.s);
    }
    std::vector<FoldEnd> ends;
    for (const mesh::Fold& fold : garment_.folds) {
      if (!is_pleat(fold)) continue;
      for (int line : fold.runs) {
        const std::vector<int> vertices = mesh::run_vertex_ids(garment_, line);
        for (const bool first : {true, false}) {
          const auto found = on_run.find(first ? vertices.front() : vertices.back());
          if (found == on_run.end() || found->second <= part.from.s + same_place || found->second >= part.to.s - same_place) continue;
          ends.push_back({found->second, line, fold.angle < 0, first});
        }
      }
    }
    std::sort(ends.begin(), ends.end(), [&](const FoldEnd& p, const FoldEnd& q) { return part.reversed ? p.s > q.s : p.s < q.s; });
    return ends;
  }

  /// Goes along the pleated side, turning round at every fold.
  Issues walk(const std::vector<RunPart>& parts) {
    double at = 0;
    bool forward = true, after_outer = true;
    for (const RunPart& part : parts) {
      double s = part.reversed ? part.to.s : part.from.s;
      std::vector<FoldEnd> ends = fold_ends(part);
      const auto go = [&](double to) {
        RunPart piece = part;
        if (std::abs(to - part.from.s) > 0 && std::abs(s - part.from.s) > 0) piece.from = {std::min(s, to), -1};
        if (std::abs(to - part.to.s) > 0 && std::abs(s - part.to.s) > 0) piece.to = {std::max(s, to), -1};
        const double length = std::abs(to - s), end = forward ? at + length : at - length;
        stretches_.push_back({piece, forward, std::min(at, end), std::max(at, end), after_outer});
        at = end;
        s = to;
      };
      for (const FoldEnd& end : ends) {
        go(end.s);
        forward = !forward;
        after_outer = end.outer;
        ends_.push_back(end);
      }
      go(part.reversed ? part.from.s : part.to.s);
    }
    if (!forward) return {issue("half_pleat", "one of its pleats has only one fold on it", "let the edge go on over the whole pleat")};
    visible_ = at;
    for (const Stretch& stretch : stretches_) {
      if (stretch.from > -same_place && stretch.to < visible_ + same_place) continue;
      return {issue("pleat_past_end", fmt::format("hidden cloth of a pleat at {:.1f} mm of {} reaches past the end of the seam", stretch.part.from.s * 1e3, run_name(garment_, stretch.part.run)), "lay the pleats farther from the end, or make them less deep")};
    }
    return {};
  }

  /// The plain side between two places, as references.
  std::vector<std::string> plain_between(double from, double to) const {
    std::vector<std::string> texts;
    double start = 0;
    for (const RunPart& part : plain_) {
      const double end = start + part.length(), low = std::max(from, start), high = std::min(to, end);
      if (high - low > same_place) {
        RunPart piece = part;
        // The ends of a whole part keep their names.
        if (low > start + same_place) (part.reversed ? piece.to : piece.from) = {part.reversed ? part.to.s - (low - start) : part.from.s + (low - start), -1};
        if (high < end - same_place) (part.reversed ? piece.from : piece.to) = {part.reversed ? part.to.s - (high - start) : part.from.s + (high - start), -1};
        texts.push_back(text_of(garment_, piece));
      }
      start = end;
    }
    return texts;
  }

  SeamSpec plain_copy() const {
    SeamSpec seam;
    seam.kind = spec_.kind;
    seam.same_direction = spec_.same_direction;
    seam.bending_factor = spec_.bending_factor;
    return seam;
  }

  std::vector<SeamSpec> stretches() const {
    // Every stretch is cut where another begins or ends, so that all layers have the same places.
    std::vector<double> places;
    for (const Stretch& stretch : stretches_) places.insert(places.end(), {stretch.from, stretch.to});
    std::sort(places.begin(), places.end());
    std::vector<double> cuts;
    for (double place : places) {
      if (cuts.empty() || place > cuts.back() + same_place) cuts.push_back(place);
    }
    const auto cut_near = [&](double place) {
      return *std::min_element(cuts.begin(), cuts.end(), [&](double p, double q) { return std::abs(p - place) < std::abs(q - place); });
    };
    std::vector<SeamSpec> seams;
    for (std::size_t k = 0; k < stretches_.size(); ++k) {
      const Stretch& stretch = stretches_[k];
      for (std::size_t c = 1; c < cuts.size(); ++c) {
        if (cuts[c - 1] < cut_near(stretch.from) || cuts[c] > cut_near(stretch.to)) continue;
        SeamSpec seam = plain_copy();
        seam.name = fmt::format("{}_{}", spec_.name, seams.size() + 1);
        RunPart part = stretch.part;
        // Along the run, places rise where both or neither of run and fold are turned.
        const bool rising = part.reversed != stretch.forward;
        const double low = cuts[c - 1] - stretch.from, high = cuts[c] - stretch.from;
        const RunPlace start = part.from, end = part.to;
        if (cuts[c - 1] > cut_near(stretch.from)) (rising ? part.from : part.to) = {rising ? start.s + low : end.s - low, -1};
        if (cuts[c] < cut_near(stretch.to)) (rising ? part.to : part.from) = {rising ? start.s + high : end.s - high, -1};
        part.reversed = !rising;
        if (!stretch.forward) seam.same_direction = !seam.same_direction;
        if (!on_top(k, cuts[c - 1], cuts[c])) seam.kind = "pleat";
        const double plain = (cuts[c] - cuts[c - 1]) * scale_;
        seam.ease = std::abs(part.length() - plain) + always_allowed;
        const std::vector<std::string> own{text_of(garment_, part)}, other = plain_between(cuts[c - 1] * scale_, cuts[c] * scale_);
        seam.a = pleated_ == 0 ? own : other;
        seam.b = pleated_ == 0 ? other : own;
        seams.push_back(std::move(seam));
      }
    }
    return seams;
  }

  /// Whether a stretch is the outermost layer between two places.
  bool on_top(std::size_t wanted, double from, double to) const {
    std::size_t top = stretches_.size();
    for (std::size_t k = 0; k < stretches_.size(); ++k) {
      const Stretch& stretch = stretches_[k];
      if (!stretch.forward || stretch.from > from + same_place || stretch.to < to - same_place) continue;
      // The cloth that ends in a visible fold lies over what comes after the pleat, cloth that begins in one over what came before.
      if (top == stretches_.size() || stretch.after_outer) top = k;
    }
    return top == wanted;
  }

  /// Seams between visible folds and the lines on which they come to lie.
  std::vector<SeamSpec> stitched_down() const {
    std::vector<SeamSpec> seams;
    for (const FoldEnd& end : ends_) {
      if (!end.outer) continue;
      const mesh::Run& fold = garment_.runs[static_cast<std::size_t>(end.run)];
      const auto at = fold.name.rfind("_outer");
      if (at == std::string::npos) continue;
      const std::string stem = fold.name.substr(0, at), rest = fold.name.substr(at + 6);
      int meet = -1;
      for (const mesh::Run& run : garment_.runs) {
        if (run.panel == fold.panel && (run.name == stem + "_meet" + rest || (stem.back() == 'b' && run.name == stem.substr(0, stem.size() - 1) + "a_meet" + rest))) meet = run.id;
      }
      if (meet < 0) continue;
      // Both lines begin on the edge, which is the end of mirrored ones.
      const double length = std::min(garment_.runs[static_cast<std::size_t>(meet)].length, fold.length);
      const auto from_edge = [&](int run) {
        const double whole = garment_.runs[static_cast<std::size_t>(run)].length, used = whole - length < same_place ? whole : length;
        return text_of(garment_, end.first ? RunPart{run, {0, -1}, {used, -1}, false} : RunPart{run, {whole - used, -1}, {whole, -1}, true});
      };
      SeamSpec seam = plain_copy();
      seam.same_direction = false;
      seam.kind = "pleat";
      seam.name = fmt::format("{}_down_{}", spec_.name, seams.size() + 1);
      seam.a = {from_edge(end.run)};
      seam.b = {from_edge(meet)};
      seams.push_back(std::move(seam));
    }
    return seams;
  }

  const GarmentMesh& garment_;
  const SeamSpec& spec_;
  const SewParams& params_;
  std::size_t pleated_ = 0;
  std::vector<RunPart> plain_;
  std::vector<Stretch> stretches_;
  std::vector<FoldEnd> ends_;
  double visible_ = 0;  ///< length of the pleated side with its pleats closed [m]
  double scale_ = 1;    ///< plain length over visible length
};

}  // namespace

std::vector<std::string> pleat_lines(const pattern::Pleated& pleated) {
  std::vector<std::string> lines;
  for (const auto& part : pleated.parts) {
    lines.push_back(part.piece + "." + part.line);
    const auto piece = std::find_if(pleated.pattern.pieces.begin(), pleated.pattern.pieces.end(), [&](const auto& p) { return p.name == part.piece; });
    if (piece->fold) lines.push_back(lines.back() + other_half);
  }
  return lines;
}

std::vector<FoldSpec> pleat_folds(const mesh::GarmentMesh& garment, const pattern::Pleated& pleated, const std::vector<pattern::PleatSpec>& specs) {
  std::vector<FoldSpec> folds;
  for (const auto& run : garment.runs) {
    const mesh::Panel& panel = garment.panels[static_cast<std::size_t>(run.panel)];
    for (const auto& part : pleated.parts) {
      if (!run.internal || part.angle == 0 || part.piece != panel.piece || (run.name != part.line && run.name != part.line + other_half)) continue;
      const pattern::PleatSpec& spec = specs[part.spec];
      FoldSpec fold;
      fold.name = panel.name + "." + run.name;
      fold.line = {fold.name};
      fold.kind = part.kind;
      fold.angle = part.angle;
      fold.radius = spec.radius;
      fold.residual = spec.residual;
      fold.factor = spec.factor;
      folds.push_back(std::move(fold));
    }
  }
  return folds;
}

Result<SewParams> expand_pleats(const GarmentMesh& garment, const SewParams& params) {
  SewParams result = params;
  result.seams.clear();
  Issues issues;
  for (const SeamSpec& seam : params.seams) {
    if (!seam.pleated) {
      result.seams.push_back(seam);
      continue;
    }
    const auto seams = PleatedSeam(garment, seam, params).expand();
    if (seams) result.seams.insert(result.seams.end(), seams->begin(), seams->end());
    else append(issues, seams.issues());
  }
  if (!issues.empty()) return issues;
  return result;
}

}  // namespace toile::tailor
