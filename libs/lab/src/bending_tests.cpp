// Tests of bending: patch energies, cantilevers, the KES-F bending test, lateral buckling.
#include <fmt/format.h>

#include <Eigen/Dense>
#include <cmath>
#include <map>
#include <numbers>

#include "bench_setup.h"
#include "toile/base/text.h"
#include "toile/lab/references.h"

namespace toile::lab {
namespace {

constexpr double earth = 9.81;

std::string common(Model model, double residual, int iterations) {
  // Cloth does not touch itself in these tests; nodes that lie near each other on flat cloth would.
  return fmt::format("model: {}\nself_reach: 0.1 mm\nresidual: {}\nmax_iterations: {}\nrecord: record.csv\n", name_of(model), format_number(residual), iterations);
}

/// Level clamp of a strip's end: with its tangent planes, or (no tangent planes in that model) two rows of particles.
std::string clamp_yaml(const Strip& strip, Model model) {
  if (model == Model::woven) return fmt::format("  - {{name: clamp, on: {}, kind: clamp}}\n", edges(strip, "clamp"));
  return "  - {name: clamp, on: [strip.clamp, strip.inner], kind: pin}\n";
}

std::string tip_of(const Strip& strip) { return strip.cut && *strip.cut != 0 ? "second.tip" : strip.cut ? "first.tip" : "strip.tip"; }

// ---------------------------------------------------------------------------------------------------------------- patch

Experiment patch(const Scope& scope) {
  struct Surface {
    const char* name;
    double uu, vv, uv;
  };
  const std::vector<Surface> surfaces{{"cylinder 0°", 1, 0, 0}, {"cylinder 30°", 0.75, 0.25, 0.4330127018922193}, {"cylinder 45°", 0.5, 0.5, 0.5},
                                      {"cylinder 90°", 0, 1, 0}, {"twist", 0, 0, 1}, {"saddle", 1, -1, 0}};
  Experiment e{.test = "patch", .title = "Bending patch tests",
               .about = "A sheet of 120 × 90 mm, cells of 10 mm, is laid on quadratic surfaces z = (a u² + 2 c uv + b v²)/2 (`toile-deform`, a Bernstein lattice, which "
                        "holds quadratics exactly). All particles are held there, the border with its tangent planes, and the bending energy is compared with "
                        "(D11 a² + D22 b² + 4 D66 c²)/2 per area ([Morley 1968](bibliography.md#morley1968)). B differs by 1.7 between warp and weft, twist ratio 0.3. "
                        "`particle` has no tangent planes: half a cell along the border does not bend in it, and it has no twist."};
  struct Key {
    Surface surface;
    Net net;
    Model model;
  };
  std::vector<Key> keys;
  const Cloth cloth{.b_warp = 2e-5, .b_weft = 1.2e-5};
  for (const Model model : models(scope)) {
    for (const Net net : all_nets) {
      if ((scope.quick && net != Net::grid && net != Net::jittered) || (scope.quick && model == Model::particle)) continue;
      for (const Surface& s : surfaces) {
        keys.push_back({s, net, model});
        const Strip sheet{.length = 0.09, .width = 0.12, .warp = 0, .cell = 0.01, .net = net};
        // Control points of X², XY, Y² on [-1, 1].
        const double square[3] = {1, -1, 1}, line[3] = {-1, 0, 1};
        std::string offsets;
        for (int i = 0; i < 3; ++i) {
          for (int j = 0; j < 3; ++j) {
            const double z = 0.5 * (s.uu * square[i] + s.vv * square[j]) + s.uv * line[i] * line[j];
            for (int k = 0; k < 2; ++k) offsets += fmt::format("{}{{node: [{}, {}, {}], by: [0, 0, {} m]}}", offsets.empty() ? "" : ", ", i, j, k, format_number(0.5 * z));
          }
        }
        // With offsets of half a metre at most the curvature is half as large.
        const std::string deform = fmt::format("lattices:\n  surface: {{low: [-1 m, -1 m, -0.1 m], high: [1 m, 1 m, 0.1 m], cells: [2, 2, 1], basis: bernstein, offsets: [{}]}}\n", offsets);
        std::string spec = common(model, 1e-4, 100) + "gravity: 0\nconstraints:\n";
        if (model == Model::woven) spec += "  - {name: border, on: [strip.low, strip.tip, strip.high, strip.clamp], kind: clamp}\n";
        spec += "  - {name: sheet, on: [strip], kind: pin}\n";
        std::string name = fmt::format("{}_{}_{}", name_of(model), sheet.file_name(), keys.size());
        e.cases.push_back(strip_case(name, sheet, cloth, spec, deform));
      }
    }
  }
  e.judge = [=](const std::vector<Outcome>& outcomes) {
    Section section;
    for (std::size_t i = 0; i < keys.size(); ++i) {
      const auto& [s, net, model] = keys[i];
      Row row = row_of("patch", s.name, model, name_of(net), "bending energy", "J", outcomes[i]);
      const double d11 = cloth.b_weft, d22 = cloth.b_warp, d66 = cloth.twist * std::sqrt(d11 * d22);
      row.reference = 0.25 * 0.5 * (d11 * s.uu * s.uu + d22 * s.vv * s.vv + 4 * d66 * s.uv * s.uv) * 0.12 * 0.09;
      if (outcomes[i].ran) row.value = outcomes[i].facts.at("bending_energy");
      row.converged = true;  // nothing can move
      row.target = net == Net::grid || net == Net::single ? 1e-6 : 0.005;
      if (model == Model::particle) row.note = net == Net::grid || net == Net::single ? "no twist; half cells along the border do not bend" : "hinges on edges";
      section.rows.push_back(row);
    }
    return section;
  };
  return e;
}

// ----------------------------------------------------------------------------------------------------------- cantilever

struct CantileverCase {
  Strip strip;
  Cloth cloth;
  double gamma = 0;
};

/// Stiff enough along the yarns not to stretch, B by direction.
CantileverCase cantilever_case(double gamma, double warp, Net net, int cells, Model model) {
  CantileverCase c;
  c.gamma = gamma;
  c.strip = {.length = 0.08, .width = 0.015, .warp = warp, .cell = 0.08 / cells, .net = net};
  if (model == Model::particle) c.strip.anchor = c.strip.cell;
  // Isotropic off the yarns, so that the strip's own stiffness is B there too; light loads on stiffer cloth.
  const double b = gamma < 1 ? 2e-4 : 2e-5;
  c.cloth = {.b_warp = b, .b_weft = warp == 45 ? b : 0.6 * b, .twist = warp == 45 ? 0.5 : 0.3};
  // On the bias it stretches by shear, at G = 40 by a per cent under its weight at 1000; the elastica does not stretch.
  if (warp == 45) c.cloth.g = 400;
  const double own = warp == 90 ? c.cloth.b_weft : c.cloth.b_warp;
  c.cloth.weight = gamma * own / (earth * std::pow(c.strip.length, 3));
  return c;
}

std::string cantilever_spec(const Strip& strip, Model model) {
  return common(model, 1e-4, 3000) + fmt::format("gravity_direction: [0, 0, -1]\nwatch: [{}, {}]\nconstraints:\n", tip_of(strip), model == Model::woven ? "strip.clamp" : "strip.inner") + clamp_yaml(strip, model);
}

Experiment cantilevers(const Scope& scope) {
  Experiment e{.test = "cantilever", .title = "Cantilever",
               .about = "A strip of 80 × 15 mm, clamped level, bends under its weight; Γ = w L³/B. Drop over reach of the free end against the heavy elastica "
                        "([Peirce 1930](bibliography.md#peirce1930), [Romero 2021](bibliography.md#romero2021)), integrated here (`libs/lab`, Runge-Kutta from the free end). Warp along the strip (0°), across it (90°, B 0.6 times), on the bias "
                        "(45°, B alike and twist ratio 0.5: isotropic, so that the elastica holds, and G ten times as large, so that it does not stretch). 64 cells along it, 128 at Γ = 1000, where 64 would be half of the length L/√Γ over which it bends: a chain of turning angles is then 1.2 % "
                        "too soft, one that bends by its chords, as this energy does, 2.5 %. `particle` has no tangent planes at clamps and holds two rows of particles: its first joint has a whole cell instead of half of one."};
  struct Key {
    CantileverCase c;
    Model model;
    int cells;
  };
  std::vector<Key> keys;
  for (const Model model : models(scope)) {
    for (const double warp : {0.0, 90.0, 45.0}) {
      for (const double gamma : {0.1, 1.0, 10.0, 100.0, 1000.0}) {
        for (const Net net : all_nets) {
          if (scope.quick && (warp != 0 || (gamma != 1 && gamma != 100) || net == Net::single || net == Net::delaunay || (model == Model::particle && net != Net::grid))) continue;
          if (model == Model::particle && (warp != 0 || gamma == 0.1 || gamma == 1000)) continue;
          // The length over which it bends is L/√Γ: 64 cells are a sixth of it up to Γ = 100 and half of it at 1000.
          const int cells = scope.quick ? 32 : gamma > 100 ? 128 : 64;
          keys.push_back({cantilever_case(gamma, warp, net, cells, model), model, cells});
          const Key& k = keys.back();
          e.cases.push_back(strip_case(fmt::format("{}_{}_{}_gamma{}", name_of(model), k.c.strip.file_name(), warp, format_number(gamma)), k.c.strip, k.c.cloth, cantilever_spec(k.c.strip, model)));
        }
      }
    }
  }
  e.judge = [=](const std::vector<Outcome>& outcomes) {
    Section section;
    std::vector<Row> group;
    Plot plot{.name = "cantilever", .title = "Cantilever, warp along the strip", .x_label = "w L³/B", .y_label = "drop over reach", .log_x = true, .log_y = true, .curves = {}};
    Curve curve{.name = "heavy elastica", .x = {}, .y = {}, .reference = true};
    for (int i = 0; i <= 40; ++i) {
      curve.x.push_back(std::pow(10, -1 + 4 * i / 40.0));
      const Cantilever c = cantilever(curve.x.back());
      curve.y.push_back(c.drop / c.reach);
    }
    plot.curves.push_back(curve);
    std::map<double, Cantilever> exact_of;
    for (const Key& k : keys) {
      if (!exact_of.count(k.c.gamma)) exact_of[k.c.gamma] = cantilever(k.c.gamma);
    }
    for (std::size_t i = 0; i < keys.size(); ++i) {
      const Key& k = keys[i];
      const Strip& strip = k.c.strip;
      const Cantilever exact = exact_of.at(k.c.gamma);
      Row row = row_of("cantilever", fmt::format("Γ = {}, warp at {}°", format_number(k.c.gamma), strip.warp), k.model, name_of(strip.net), "drop over reach", "1", outcomes[i]);
      row.reference = exact.drop / exact.reach;
      row.target = k.c.gamma <= 100 && k.cells >= 64 ? 0.003 : 0.01;
      if (outcomes[i].ran) {
        const Table& r = outcomes[i].record;
        const Eigen::Vector3d d = watched(r, "strip.tip", row_count(r) - 1) - watched(r, k.model == Model::woven ? "strip.clamp" : "strip.inner", row_count(r) - 1);
        row.value = -d.z() / d.dot(along(strip));
        if (row.verdict() != Verdict::met && k.model == Model::particle) row.note = strip.net == Net::grid || strip.net == Net::single ? fmt::format("whole cell at the clamp: (1 + 1/n)² is {:.3g}", std::pow(1 + 1.0 / k.cells, 2)) : "hinges on edges";
        else if (row.verdict() != Verdict::met) row.note = fmt::format("{} cells; a cell is {:.2g} of the length L/√Γ over which it bends; it bends by chords, not angles", k.cells, std::sqrt(k.c.gamma) / k.cells);
        if (strip.warp == 0) {
          const std::string name = fmt::format("{}, {}", name_of(k.model), name_of(strip.net));
          auto found = std::find_if(plot.curves.begin(), plot.curves.end(), [&](const Curve& c) { return c.name == name; });
          if (found == plot.curves.end()) {
            plot.curves.push_back({name, {}, {}, false});
            found = plot.curves.end() - 1;
          }
          found->x.push_back(k.c.gamma);
          found->y.push_back(*row.value);
        }
      }
      section.rows.push_back(row);
      group.push_back(row);
      const bool last = i + 1 == keys.size() || keys[i + 1].c.gamma != k.c.gamma || keys[i + 1].c.strip.warp != strip.warp || keys[i + 1].model != k.model;
      if (last && group.size() > 1) section.rows.push_back(spread_of(group, 0.005));
      if (last) group.clear();
    }
    section.plots.push_back(plot);
    return section;
  };
  return e;
}

// ------------------------------------------------------------------------------------------------------- bending length

constexpr double dip = 41.5 * std::numbers::pi / 180;  // where the standards read the bending length

/// overhang() by the secant rule from a guess that is near.
double overhang_near(double angle, double rho, double guess) {
  const auto miss = [&](double l) {
    const Cantilever c = cantilever(l * l * l, rho * l);
    return std::atan2(c.drop, c.reach) - angle;
  };
  double a = guess, b = 1.01 * guess, at_a = miss(a), at_b = miss(b);
  for (int i = 0; i < 20 && std::abs(at_b) > 1e-10 && at_a != at_b; ++i) {
    const double next = b - at_b * (b - a) / (at_b - at_a);
    a = b;
    at_a = at_b;
    b = next;
    at_b = miss(b);
  }
  return b;
}

Experiment bending_length(const Scope& scope) {
  Experiment e{.test = "bending_length", .title = "Bending length read at 41.5°",
               .about = "A strip of 15 mm, cells of 1.25 mm (with friction 2.5 mm), hangs over the edge by what should bring the chord to its end down to 41.5°, where the standards read the bending length as half of the overhang ([Peirce 1930](bibliography.md#peirce1930)). "
                        "From the angle that it comes to follows the overhang at 41.5° and the rigidity that one would read, w (overhang/2)³, over B. Without friction that is B itself (the elastica's overhang is 2.0004 bending lengths). With M = B κ + HB, "
                        "ρ = HB (B/w)^(1/3)/B, it is far more: what a cantilever reads of cloth with friction is not KES-F's B. Loaded once from straight, in ten steps."};
  struct Key {
    Strip strip;
    double rho, overhang;  ///< overhang: in bending lengths, of the strip
  };
  std::vector<Key> keys;
  // Overhangs that dip by about 41.5 degrees.
  for (const auto& [rho, hangs] : {std::pair{0.0, 2.0}, {0.2, 2.178}, {0.5, 2.405}, {1.0, 2.727}}) {
    for (const Net net : {Net::grid, Net::jittered}) {
      if (!scope.woven || (net != Net::grid && (scope.quick || rho != 0)) || (scope.quick && rho != 0)) continue;
      const double length = 0.08, c = length / hangs;
      Cloth cloth{.b_warp = 2e-5, .b_weft = 2e-5};
      cloth.weight = cloth.b_warp / (earth * c * c * c);
      cloth.hb_warp = cloth.hb_weft = 2 * rho * cloth.b_warp / c;
      const Strip strip{.length = length, .width = 0.015, .warp = 0, .cell = rho > 0 ? 0.0025 : 0.00125, .net = net};
      std::string spec = common(Model::woven, 1e-4, 3000) + "gravity_direction: [0, 0, -1]\nwatch: [strip.tip, strip.clamp]\nconstraints:\n  - {name: clamp, on: [strip.clamp], kind: clamp}\n";
      if (rho > 0) spec += "internal_friction: yes\ngravity_times: [0 s, 10 s]\ngravity_factor: [0, 1]\nincrements: 10\nduration: 10 s\n";
      e.cases.push_back(strip_case(fmt::format("woven_{}_rho{}", strip.file_name(), format_number(rho)), strip, cloth, spec));
      keys.push_back({strip, rho, hangs});
    }
  }
  e.judge = [=](const std::vector<Outcome>& outcomes) {
    Section section;
    for (std::size_t i = 0; i < keys.size(); ++i) {
      const auto& [strip, rho, hangs] = keys[i];
      const double exact = overhang_near(dip, rho, hangs);
      Row row = row_of("bending_length", fmt::format("ρ = {}", format_number(rho)), Model::woven, name_of(strip.net), "rigidity read over B", "1", outcomes[i]);
      row.reference = std::pow(0.5 * exact, 3);
      row.target = 0.02;
      if (outcomes[i].ran && row_count(outcomes[i].record) > 0) {
        const std::size_t last = row_count(outcomes[i].record) - 1;
        const Eigen::Vector3d d = watched(outcomes[i].record, "strip.tip", last) - watched(outcomes[i].record, "strip.clamp", last);
        const double angle = std::atan2(-d.z(), d.dot(along(strip)));
        if (angle > 0.5 * dip && angle < 1.5 * dip) {
          // The strip that would dip by 41.5 degrees is longer or shorter as theory says between the two angles.
          row.value = std::pow(0.5 * hangs * exact / overhang_near(angle, rho, hangs), 3);
        }
        row.note = fmt::format("dips by {:.2f}°", angle * 180 / std::numbers::pi);
      }
      section.rows.push_back(row);
    }
    return section;
  };
  return e;
}

// ---------------------------------------------------------------------------------------------------------- KES bending

Experiment kes_bending(const Scope& scope) {
  Experiment e{.test = "kes_bending", .title = "KES-F bending",
               .about = "20 mm of the suiting between two clamps 10 mm apart, bent to 2.5/cm, to −2.5/cm and again to 2.5/cm, the clamps on the arcs of pure bending; cells of 0.5 mm. Moment per "
                        "width over curvature: B is the slope from 0.5 to 1.5/cm (mean of both ways), 2HB the width of the loop at 1/cm; on the way back 2HB/(2 B) of curvature is left without a moment ([Kawabata 1980](bibliography.md#kawabata1980)). The jaws of the "
                        "instrument are 20 cm wide; the strip is homogeneous across."};
  struct Key {
    double warp;
    Net net;
  };
  std::vector<Key> keys;
  std::vector<double> curvature{0};  // [1/cm]
  for (int i = 1; i <= 10; ++i) curvature.push_back(0.25 * i);
  for (int i = 1; i <= 20; ++i) curvature.push_back(2.5 - 0.25 * i);
  for (int i = 1; i <= 20; ++i) curvature.push_back(-2.5 + 0.25 * i);
  const double gauge = 0.01;
  if (scope.woven) {
    for (const double warp : {0.0, 90.0}) {
      for (const Net net : {Net::grid, Net::jittered}) {
        if (scope.quick && (net != Net::grid || warp != 0)) continue;
        const Strip strip{.length = gauge, .width = 0.02, .warp = warp, .cell = 0.0005, .net = net};
        std::vector<Eigen::Vector3d> moves;
        std::vector<double> turns;
        for (const double k : curvature) {
          const double angle = 100 * k * gauge;
          const double out = angle == 0 ? gauge : gauge * std::sin(angle) / angle, up = angle == 0 ? 0 : gauge * (1 - std::cos(angle)) / angle;
          moves.push_back((out - gauge) * along(strip) + Eigen::Vector3d(0, 0, up));
          turns.push_back(angle);
        }
        const Eigen::Vector3d axis = along(strip).cross(Eigen::Vector3d::UnitZ());
        std::string spec = common(Model::woven, 1e-4, 1000) + fmt::format("internal_friction: yes\ngravity: 0\nincrements: {}\nduration: {} s\nconstraints:\n  - {{name: fixed, on: [strip.clamp], kind: clamp}}\n", curvature.size() - 1, curvature.size() - 1);
        spec += path_yaml("jaw", "[strip.tip]", "clamp", moves, turns, axis, place(strip, gauge, 0.5 * strip.width));
        keys.push_back({warp, net});
        e.cases.push_back(strip_case(fmt::format("woven_{}_{}", strip.file_name(), warp), strip, suiting(), spec));
      }
    }
  }
  e.judge = [=](const std::vector<Outcome>& outcomes) {
    Section section;
    Plot plot{.name = "kes_bending", .title = "KES-F bending of the suiting", .x_label = "curvature [1/cm]", .y_label = "moment per width [mN]", .curves = {}};
    const Cloth cloth = suiting();
    for (const double b : {cloth.b_warp, cloth.b_weft}) plot.curves.push_back({b == cloth.b_warp ? "B of the warp" : "B of the weft", {-2.5, 2.5}, {-250 * b * 1e3, 250 * b * 1e3}, true});
    for (std::size_t i = 0; i < keys.size(); ++i) {
      const auto& [warp, net] = keys[i];
      const Strip strip{.length = gauge, .width = 0.02, .warp = warp, .cell = 0.0005, .net = net};
      const std::string subject = warp == 0 ? "warp" : "weft";
      Row b = row_of("kes_bending", subject, Model::woven, name_of(net), "B", "N m", outcomes[i]);
      Row loop = row_of("kes_bending", subject, Model::woven, name_of(net), "2HB", "N", outcomes[i]);
      Row rest = row_of("kes_bending", subject, Model::woven, name_of(net), "curvature left at no moment", "1/m", outcomes[i]);
      rest.reference = 0.5 * (warp == 0 ? cloth.hb_warp / cloth.b_warp : cloth.hb_weft / cloth.b_weft);
      rest.target = 0.02;
      b.reference = warp == 0 ? cloth.b_warp : cloth.b_weft;
      loop.reference = warp == 0 ? cloth.hb_warp : cloth.hb_weft;
      b.target = 0.01;
      loop.target = 0.01;
      if (outcomes[i].ran) {
        const Eigen::Vector3d axis = along(strip).cross(Eigen::Vector3d::UnitZ());
        std::vector<double> moment = component(outcomes[i].record, "jaw", "moment", "Nm", axis);
        for (double& m : moment) m /= strip.width;
        // Rows of the record are the increments; the path's first row is the start. Second way up and the way down before it.
        const auto stretch = [&](std::size_t from, std::size_t to) {
          std::array<std::vector<double>, 2> xy;
          for (std::size_t k = from; k <= to && k <= moment.size(); ++k) {
            xy[0].push_back(100 * curvature[k]);
            xy[1].push_back(k == 0 ? 0 : moment[k - 1]);
          }
          return xy;
        };
        const auto down = stretch(10, 30), up = stretch(30, 50);
        const auto slope = [&](const std::array<std::vector<double>, 2>& part, double low, double high) {
          std::vector<double> x, y;
          for (std::size_t k = 0; k < part[0].size(); ++k) {
            if (part[0][k] < low - 1e-9 || part[0][k] > high + 1e-9) continue;
            x.push_back(part[0][k]);
            y.push_back(part[1][k]);
          }
          return line_fit(x, y)[1];
        };
        b.value = 0.5 * (slope(up, 50, 150) + slope(down, -150, -50));
        loop.value = interpolated(up[0], up[1], 100) - interpolated(down[0], down[1], 100);
        rest.value = interpolated(down[1], down[0], 0);
        Curve curve{fmt::format("{}, {}", subject, name_of(net)), {}, {}, false};
        for (std::size_t k = 0; k < moment.size(); ++k) {
          curve.x.push_back(curvature[k + 1]);
          curve.y.push_back(1e3 * moment[k]);
        }
        plot.curves.push_back(curve);
      }
      section.rows.push_back(b);
      section.rows.push_back(loop);
      section.rows.push_back(rest);
    }
    section.plots.push_back(plot);
    return section;
  };
  return e;
}

}  // namespace

std::vector<Experiment> bending_tests(const Scope& scope) { return {patch(scope), cantilevers(scope), bending_length(scope), kes_bending(scope)}; }

}  // namespace toile::lab
