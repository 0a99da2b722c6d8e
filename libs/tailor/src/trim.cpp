#include "toile/tailor/trim.h"

#include "line_part.h"

#include "toile/base/text.h"
#include "toile/tailor/fold.h"
#include "toile/tailor/quality.h"
#include "toile/tailor/sew.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

namespace toile::tailor {
namespace {

using mesh::GarmentMesh;

/// Resolves a list of references; troubles go to `issues` under `item`.
std::vector<LinePart> find_lines(const GarmentMesh& garment, const std::vector<std::string>& texts, const std::string& item, Issues& issues) {
  std::vector<LinePart> parts;
  for (const std::string& text : texts) {
    auto found = find_line(garment, text);
    if (found) {
      parts.insert(parts.end(), found->begin(), found->end());
      continue;
    }
    for (Issue issue : found.issues()) {
      issue.place.item = item;
      issues.push_back(std::move(issue));
    }
  }
  return parts;
}

double distance(const GarmentMesh& garment, int a, int b) { return (garment.uv.row(a) - garment.uv.row(b)).norm(); }

double length_of(const GarmentMesh& garment, const std::vector<LinePart>& parts) {
  double length = 0;
  for (const LinePart& part : parts) {
    for (std::size_t k = 1; k < part.vertices.size(); ++k) length += distance(garment, part.vertices[k - 1], part.vertices[k]);
  }
  return length;
}

/// A garment that gets trims.
class Haberdasher {
 public:
  explicit Haberdasher(const GarmentMesh& garment) {
    result_.garment = garment;
    for (const auto& trim : garment.trims) names_.insert(trim.name);
  }

  /// Lays a trim along lines; without length it would pull on nothing and is left out.
  void lay(mesh::Trim trim, const std::vector<LinePart>& parts) {
    if (!names_.insert(trim.name).second) {
      issues_.push_back({"duplicate_name", {.item = "trim " + trim.name}, "two trims have this name", "rename one"});
      return;
    }
    trim.id = static_cast<int>(result_.garment.trims.size());
    TrimReport report{trim.name, trim.kind};
    for (const LinePart& part : parts) {
      for (std::size_t k = 1; k < part.vertices.size(); ++k) {
        const double under = distance(result_.garment, part.vertices[k - 1], part.vertices[k]);
        result_.garment.trim_segments.push_back({part.vertices[k - 1], part.vertices[k], trim.id, trim.rest_ratio * under});
        report.length += under;
        ++report.segments;
      }
    }
    result_.garment.trims.push_back(std::move(trim));
    result_.trims.push_back(std::move(report));
  }

  GarmentMesh& garment() { return result_.garment; }
  Issues& issues() { return issues_; }
  Result<Trimmed> done() && {
    if (!issues_.empty()) return std::move(issues_);
    return std::move(result_);
  }

 private:
  Trimmed result_;
  Issues issues_;
  std::set<std::string> names_;
};

/// Area of the cloth between the two legs of a dart.
double intake_area(const GarmentMesh& garment, const std::vector<LinePart>& a, const std::vector<LinePart>& b) {
  std::vector<Eigen::Vector2d> loop;
  for (const LinePart& part : a) {
    for (int v : part.vertices) loop.emplace_back(garment.uv.row(v));
  }
  for (auto part = b.rbegin(); part != b.rend(); ++part) {
    for (auto v = part->vertices.rbegin(); v != part->vertices.rend(); ++v) loop.emplace_back(garment.uv.row(*v));
  }
  double twice = 0;
  for (std::size_t k = 0; k < loop.size(); ++k) {
    const Eigen::Vector2d &p = loop[k], &q = loop[(k + 1) % loop.size()];
    twice += p.x() * q.y() - p.y() * q.x();
  }
  return std::abs(twice) / 2;
}

std::string line_name(const GarmentMesh& garment, int run) {
  const mesh::Run& row = garment.runs[static_cast<std::size_t>(run)];
  return garment.panels[static_cast<std::size_t>(row.panel)].name + "." + row.name;
}

void lay_allowances(Haberdasher& shop, const SeamSpec& seam, int id, const std::vector<std::vector<LinePart>>& sides) {
  const Allowance allowance = seam.allowance.value_or(seam.kind == "felled" ? Allowance::felled : Allowance::none);
  if (allowance == Allowance::none) return;
  const GarmentMesh& garment = shop.garment();
  for (std::size_t side = 0; side < sides.size(); ++side) {
    std::map<int, int> uses;
    for (const LinePart& part : sides[side]) {
      const mesh::Run& run = garment.runs[static_cast<std::size_t>(part.run)];
      // A felled seam's wider allowance is folded in half. The cloth of a dart is folded in the middle, too.
      double width = allowance == Allowance::felled ? run.allowance / 2 : run.allowance;
      if (seam.kind == "dart") width = intake_area(garment, sides[0], sides[1]) / (2 * length_of(garment, sides[side]));
      if (seam.allowance_width) width = *seam.allowance_width;
      if (width <= 0) {
        shop.issues().push_back({"no_allowance", {.item = "seam " + seam.name}, fmt::format("'{}' has no seam allowance in the pattern", line_name(garment, part.run)), "give `allowance_width`, or the edge's allowance in the pattern"});
        continue;
      }
      mesh::Trim trim;
      trim.name = fmt::format("{} allowance {}", seam.name, line_name(garment, part.run));
      if (const int use = ++uses[part.run]; use > 1) trim.name += fmt::format(" {}", use);
      trim.kind = "allowance";
      trim.seam = id;
      trim.width = width;
      trim.plies = allowance == Allowance::felled && side == 0 ? 2 : 1;
      shop.lay(std::move(trim), {part});
    }
  }
}

mesh::Trim thread_of(const SeamThread& thread, const std::string& name, const char* kind, int seam) {
  mesh::Trim trim;
  trim.name = name;
  trim.kind = kind;
  trim.seam = seam;
  trim.stretch = thread.stretch;
  trim.linear_density = thread.mass;
  trim.rest_ratio = thread.ratio;
  trim.slack = true;
  return trim;
}

/// Bending rigidity per width about an axis square to a direction (u, v) of the cloth.
double bending_along(const fabric::Card& card, const Eigen::Vector2d& direction) {
  const Eigen::Vector2d d = direction.normalized();
  const double weft = d.x() * d.x(), warp = d.y() * d.y();
  const double twist = card.twist_ratio * std::sqrt(card.warp.bending * card.weft.bending);
  return card.warp.bending * warp * warp + card.weft.bending * weft * weft + 4 * twist * warp * weft;
}

}  // namespace

Result<Trimmed> finish_seams(const GarmentMesh& garment, const std::vector<SeamSpec>& seams) {
  Haberdasher shop(garment);
  std::vector<const SeamSpec*> order;
  for (const SeamSpec& seam : seams) {
    const bool allowance = seam.allowance ? *seam.allowance != Allowance::none : seam.kind == "felled";
    if (seam.tape || seam.thread || seam.elastic || seam.angle || allowance || seam.kind == "taped") order.push_back(&seam);
  }
  std::sort(order.begin(), order.end(), [](const SeamSpec* a, const SeamSpec* b) { return a->name < b->name; });
  for (const SeamSpec* seam : order) {
    const std::string item = "seam " + seam->name;
    const auto complain = [&](Issue issue) {
      issue.place.item = item;
      shop.issues().push_back(std::move(issue));
    };
    if (seam->kind == "taped" && !seam->tape) complain({"untaped", {}, "it is taped, but with what is not said", "give `tape` with its width, B, stretch and mass"});
    if (seam->pleated && seam->angle) complain({"angle_with_pleats", {}, "an angle is given for a seam that holds pleats", "leave it out: the layers in such a seam have no one angle"});
    // A pleated seam has a row for each of its stretches; its trims go with the first.
    const std::string row_name = seam->pleated ? seam->name + "_1" : seam->name;
    const auto row = std::find_if(garment.seams.begin(), garment.seams.end(), [&](const mesh::Seam& s) { return s.name == row_name; });
    if (row == garment.seams.end()) {
      complain({"unknown_seam", {}, "the garment has no such seam", "sew it first"});
      continue;
    }
    std::vector<std::vector<LinePart>> sides{find_lines(garment, seam->a, item, shop.issues()), find_lines(garment, seam->b, item, shop.issues())};
    for (const auto& side : seam->more) sides.push_back(find_lines(garment, side, item, shop.issues()));
    const std::vector<LinePart>& line = seam->pleated && length_of(garment, sides[1]) < length_of(garment, sides[0]) ? sides[1] : sides[0];
    if (seam->tape) {
      mesh::Trim trim;
      trim.name = seam->name + " tape";
      trim.kind = "tape";
      trim.seam = row->id;
      trim.stretch = seam->tape->stretch;
      trim.bending = seam->tape->bending * seam->tape->width;
      trim.linear_density = seam->tape->mass;
      trim.rest_ratio = seam->tape->ratio;
      trim.width = seam->tape->width;
      shop.lay(std::move(trim), line);
    }
    if (seam->thread) shop.lay(thread_of(*seam->thread, seam->name + " thread", "thread", row->id), line);
    if (seam->elastic) shop.lay(thread_of(*seam->elastic, seam->name + " elastic", "elastic", row->id), line);
    lay_allowances(shop, *seam, row->id, sides);
    if (!seam->angle || seam->pleated || sides[0].empty() || sides[1].empty()) continue;
    std::vector<std::vector<int>> a;
    for (const LinePart& part : sides[0]) a.push_back(part.vertices);
    std::vector<int> b;
    for (const LinePart& part : sides[1]) b.insert(b.end(), part.vertices.begin(), part.vertices.end());
    const auto hinges = seam_hinges(garment, a, b, *seam->angle, row->bending_factor);
    if (hinges) {
      shop.garment().hinges.insert(shop.garment().hinges.end(), hinges->begin(), hinges->end());
    } else {
      for (const Issue& issue : hinges.issues()) complain(issue);
    }
  }
  return std::move(shop).done();
}

Result<Trimmed> add_trims(const GarmentMesh& garment, const std::vector<TrimSpec>& trims) {
  Haberdasher shop(garment);
  std::vector<const TrimSpec*> order;
  for (const TrimSpec& trim : trims) order.push_back(&trim);
  std::sort(order.begin(), order.end(), [](const TrimSpec* a, const TrimSpec* b) { return a->name < b->name; });
  const mesh::Ids particle = order.empty() ? mesh::Ids() : mesh::particles(garment);
  for (const TrimSpec* spec : order) {
    const std::string item = "trim " + spec->name;
    if (spec->along.empty()) shop.issues().push_back({"no_line", {.item = item}, "it runs along no line", "name at least one: panel.line"});
    const std::vector<LinePart> parts = find_lines(garment, spec->along, item, shop.issues());
    if (parts.size() < spec->along.size()) continue;
    for (std::size_t k = 1; k < parts.size(); ++k) {
      const int end = parts[k - 1].vertices.back(), start = parts[k].vertices.front();
      if (particle[end] == particle[start]) continue;
      shop.issues().push_back({"broken_chain", {.item = item}, fmt::format("'{}' ends at panel {}, '{}' begins at panel {}: these are not sewn together", line_name(garment, parts[k - 1].run), place_text(garment, end), line_name(garment, parts[k].run), place_text(garment, start)),
                               "put '-' before lines that run the other way, correct their order, or sew the panels", Category::check});
    }
    static constexpr std::array kinds{"tape", "elastic", "drawstring"};
    mesh::Trim trim;
    trim.name = spec->name;
    trim.kind = kinds[static_cast<std::size_t>(spec->kind)];
    trim.stretch = spec->stretch;
    trim.bending = spec->bending;
    trim.linear_density = spec->mass;
    trim.rest_ratio = spec->ratio;
    trim.slack = spec->slack.value_or(spec->kind != TrimKind::tape);
    trim.width = spec->width;
    shop.lay(std::move(trim), parts);
  }
  return std::move(shop).done();
}

GarmentMesh resolve_allowances(const GarmentMesh& garment) {
  GarmentMesh result = garment;
  // The cloth of each panel: the sheet that came with no layer, of its first face.
  std::vector<const mesh::Ply*> cloth(garment.panels.size(), nullptr);
  std::vector<const fabric::Card*> cards(garment.panels.size(), nullptr);
  for (Eigen::Index f = 0; f < garment.face_count(); ++f) {
    const auto panel = static_cast<std::size_t>(garment.face_panel[f]);
    if (cloth[panel] || garment.face_laminate[f] < 0) continue;
    for (const mesh::Ply& ply : garment.laminates[static_cast<std::size_t>(garment.face_laminate[f])].plies) {
      if (!ply.layer.empty() || cloth[panel]) continue;
      cloth[panel] = &ply;
      for (const auto& card : garment.fabrics) {
        if (card.name == ply.fabric) cards[panel] = &card;
      }
    }
  }
  std::vector<double> length(garment.trims.size(), 0), mass(garment.trims.size(), 0), bending(garment.trims.size(), 0);
  for (const auto& segment : garment.trim_segments) {
    const auto trim = static_cast<std::size_t>(segment.trim);
    const auto panel = static_cast<std::size_t>(garment.vertex_panel[segment.a]);
    if (garment.trims[trim].kind != "allowance" || !cloth[panel]) continue;
    const Eigen::Vector2d way = (garment.uv.row(segment.b) - garment.uv.row(segment.a)).transpose();
    length[trim] += way.norm();
    mass[trim] += way.norm() * cloth[panel]->areal_density;
    if (cards[panel]) bending[trim] += way.norm() * bending_along(*cards[panel], way);
  }
  for (std::size_t t = 0; t < result.trims.size(); ++t) {
    if (length[t] == 0) continue;
    const double strip = result.trims[t].width * result.trims[t].plies;
    result.trims[t].linear_density = strip * mass[t] / length[t];
    result.trims[t].bending = strip * bending[t] / length[t];
  }
  return result;
}

}  // namespace toile::tailor
