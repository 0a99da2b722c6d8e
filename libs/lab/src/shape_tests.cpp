// Tests of the shapes that cloth takes: lateral buckling, bending with friction, sliding, drape.
#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "bench_setup.h"
#include "toile/base/text.h"
#include "toile/io/ply.h"
#include "toile/lab/references.h"

namespace toile::lab {
namespace {

constexpr double earth = 9.81;
using std::numbers::pi;

std::string common(Model model, double residual, int iterations) {
  return fmt::format("model: {}\nself_reach: 0.1 mm\nresidual: {}\nmax_iterations: {}\nrecord: record.csv\n", name_of(model), format_number(residual), iterations);
}

// ----------------------------------------------------------------------------------------------------- lateral buckling

Experiment buckling(const Scope& scope) {
  Experiment e{.test = "lateral_buckling", .title = "Lateral buckling",
               .about = "A strip of 200 mm stands on edge, clamped at one end, its weight in its plane; from Γ* = w L³/D11 on it tips over sideways ([Romero 2021](bibliography.md#romero2021)). In its plane it comes to rest at 97 and 103 % of the reference; the smallest "
                        "stiffness of these equilibria against mass (`stability`), a function of Γ² since the strip buckles for either direction of gravity, is zero at Γ* on the straight line through both. Pushing it sideways, as was done before, does not do: cloth as stiff in its plane as this resists a twist "
                        "of 0.1 mm already. Reference: Rayleigh-Ritz, plate of degree 15 × 5 on plane stress of degree 14 × 7 (`libs/lab`). Without Poisson's ratio in bending, which `woven` does not have."};
  struct Key {
    Strip strip;
    Cloth cloth;
    double reference = 0;
  };
  std::vector<Key> keys;
  const std::vector<double> parts{0.97, 1.03};
  if (scope.woven) {
    for (const auto& [aspect, twist] : {std::pair{0.05, 0.5}, {0.2, 0.5}, {0.5, 0.5}, {1.0, 0.5}, {0.2, 0.25}, {0.2, 0.1}}) {
      for (const Net net : {Net::grid, Net::jittered}) {
        if (net != Net::grid && aspect != 0.2) continue;
        if (scope.quick && (net != Net::grid || aspect != 0.2 || twist != 0.25)) continue;
        Key k{{.length = 0.2, .width = 0.2 * aspect, .warp = 0, .cell = aspect < 0.1 ? 0.0025 : aspect < 0.4 ? 0.005 : 0.01, .net = net},
              {.force_max = 1000, .b_warp = 2e-4, .b_weft = 2e-4, .g = 5e4, .twist = twist}, lateral_buckling(aspect, twist)};
        k.cloth.weight = k.reference * k.cloth.b_warp / (earth * std::pow(k.strip.length, 3));
        std::string spec = common(Model::woven, 1e-3, 6000) + fmt::format("stability: true\ngravity_direction: {}\ngravity_times: [0 s", vector_yaml(-across(k.strip)));
        for (std::size_t i = 0; i < parts.size(); ++i) spec += fmt::format(", {} s", i + 1);
        spec += "]\ngravity_factor: [0";
        for (const double p : parts) spec += fmt::format(", {}", p);
        spec += fmt::format("]\nincrements: {0}\nduration: {0} s\nconstraints:\n  - {{name: clamp, on: [strip.clamp], kind: clamp}}\n", parts.size());
        e.cases.push_back(strip_case(fmt::format("woven_{}_{}_{}", k.strip.file_name(), aspect, twist), k.strip, k.cloth, spec));
        keys.push_back(k);
      }
    }
  }
  e.judge = [=](const std::vector<Outcome>& outcomes) {
    Section section;
    for (std::size_t i = 0; i < keys.size(); ++i) {
      const Key& k = keys[i];
      Row row = row_of("lateral_buckling", fmt::format("w/L = {}, D66/D11 = {}", format_number(std::round(100 * k.strip.width / k.strip.length) / 100), k.cloth.twist), Model::woven, name_of(k.strip.net), "Γ*", "1", outcomes[i]);
      row.reference = k.reference;
      row.target = 0.02;
      const auto column = outcomes[i].record.find("lowest_stiffness_per_s2");
      if (outcomes[i].ran && column != outcomes[i].record.end() && column->second.size() == parts.size()) {
        const double a = parts[0] * parts[0], b = parts[1] * parts[1], low = column->second[0], high = column->second[1];
        row.value = k.reference * std::sqrt(a + (b - a) * low / (low - high));
      }
      section.rows.push_back(row);
    }
    return section;
  };
  return e;
}

// -------------------------------------------------------------------------------------------------- friction cantilever

Experiment friction_cantilever(const Scope& scope) {
  Experiment e{.test = "friction_cantilever", .title = "Cantilever with internal friction",
               .about = "The cantilever with M = B κ + HB (HB half of 2HB), loaded from straight in ten steps; η = HB L/B. It stays straight up to Γ = 2 η; reference integrated as for the elastica. At Γ = 100 the curvature away from the clamp "
                        "falls again while the load grows, and friction holds some of it there: the shape depends on the path (by 12 % in this quantity). Its reference for a load that grows follows the path (`loaded_cantilever` in `libs/lab`, a chain of 400 "
                        "links with rigid-plastic sliders, 200 steps); that for the whole load at once is the integrated one."};
  struct Key {
    double gamma, eta;
    int steps;
  };
  const std::vector<Key> keys_all{{10, 0.5, 10}, {10, 1, 10}, {10, 2, 10}, {100, 2, 10}, {100, 2, 1}};
  std::vector<Key> keys;
  const Strip strip{.length = 0.08, .width = 0.015, .warp = 0, .cell = 0.0025};
  if (scope.woven) {
    for (const auto& [gamma, eta, steps] : keys_all) {
      if (scope.quick && (gamma != 100 || steps == 1)) continue;
      Cloth cloth{.b_warp = 2e-5, .b_weft = 2e-5};
      cloth.weight = gamma * cloth.b_warp / (earth * std::pow(strip.length, 3));
      cloth.hb_warp = cloth.hb_weft = 2 * eta * cloth.b_warp / strip.length;
      std::string spec = common(Model::woven, 1e-4, 3000) + fmt::format("gravity_direction: [0, 0, -1]\ngravity_times: [0 s, 10 s]\ngravity_factor: [0, 1]\nincrements: {}\nduration: 10 s\nwatch: [strip.tip, strip.clamp]\n", steps) +
                         "internal_friction: yes\nconstraints:\n  - {name: clamp, on: [strip.clamp], kind: clamp}\n";
      e.cases.push_back(strip_case(fmt::format("woven_gamma{}_eta{}_steps{}", gamma, eta, steps), strip, cloth, spec));
      keys.push_back({gamma, eta, steps});
    }
  }
  e.judge = [=](const std::vector<Outcome>& outcomes) {
    Section section;
    for (std::size_t i = 0; i < keys.size(); ++i) {
      const auto& [gamma, eta, steps] = keys[i];
      Row row = row_of("friction_cantilever", fmt::format("Γ = {}, η = {}{}", gamma, eta, steps == 1 ? ", at once" : ""), Model::woven, "grid", "drop over reach", "1", outcomes[i]);
      const Cantilever exact = steps > 1 && gamma > 10 ? loaded_cantilever(gamma, eta, 200) : cantilever(gamma, eta);
      row.reference = exact.drop / exact.reach;
      row.target = 0.02;
      if (outcomes[i].ran) {
        const Table& r = outcomes[i].record;
        const Eigen::Vector3d d = watched(r, "strip.tip", row_count(r) - 1) - watched(r, "strip.clamp", row_count(r) - 1);
        row.value = -d.z() / d.dot(along(strip));
      }
      section.rows.push_back(row);
    }
    return section;
  };
  return e;
}

// -------------------------------------------------------------------------------------------------------------- incline

/// A box from -1 to 1 m along two axes; along `axis` it ends at `face` and reaches 0.2 m back from there, to lower values where `below`.
mesh::SupportMesh box(int axis, double face, bool below) {
  mesh::SupportMesh s;
  s.x.resize(8, 3);
  const double far = below ? face - 0.2 : face + 0.2, low = std::min(face, far), high = std::max(face, far);
  for (int k = 0; k < 8; ++k) {
    for (int c = 0; c < 3; ++c) {
      const bool up = (k >> c) & 1;
      s.x(k, c) = c == axis ? (up ? high : low) : (up ? 1.0 : -1.0);
    }
  }
  s.faces.resize(12, 3);
  s.faces << 0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4, 2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5;
  s.face_region = mesh::Ids::Constant(12, -1);
  return s;
}

constexpr double reach = 2e-3, push_stiffness = 5e5;  // defaults of toile-simulate

/// Adds a support to the simulation of a case.
void put_on(Case& c, const mesh::SupportMesh& support) {
  c.files.push_back({"support.ply", io::format_support(support, io::Encoding::ascii)});
  c.steps.back().args.insert(c.steps.back().args.begin() + 1, "support.ply");
}

Experiment incline(const Scope& scope) {
  Experiment e{.test = "incline", .title = "Sliding on an incline",
               .about = "A square of 60 mm of the suiting on a plane, friction 0.3, where the push of the plane carries it; gravity as on a slope of 0.9, 0.999, 1.001, 1.1 and 1.5 times that, for a second. Below, the cloth has to stay; "
                        "above, the coefficient follows from its acceleration, μ = tan α − a/(g cos α), between the quarters of the last half second."};
  std::vector<double> keys;
  const double mu = 0.3;
  const Strip strip{.length = 0.06, .width = 0.06, .warp = 0, .cell = 0.01};
  if (scope.woven && !scope.quick) {
    for (const double part : {0.9, 0.999, 1.001, 1.1, 1.5}) {
      const double a = std::atan(part * mu);
      const Eigen::Vector3d down = std::sin(a) * along(strip) - std::cos(a) * Eigen::Vector3d::UnitZ();
      std::string spec = fmt::format("mode: motion\nduration: 1 s\ntime_step: 0.01 s\nair_drag: 0\nsupport_friction: {}\ngravity_direction: {}\nrecord: record.csv\nwatch: [strip]\n", mu, vector_yaml(down));
      spec += "newton_accuracy: 1e-10 m\n";
      Case c = strip_case(fmt::format("woven_{}", part), strip, suiting(), spec);
      put_on(c, box(2, -(reach - suiting().weight * earth * std::cos(a) / push_stiffness), true));
      e.cases.push_back(c);
      keys.push_back(part);
    }
  }
  e.judge = [=](const std::vector<Outcome>& outcomes) {
    Section section;
    for (std::size_t i = 0; i < keys.size(); ++i) {
      const double part = keys[i], a = std::atan(part * mu);
      Row row = row_of("incline", fmt::format("tan α = {} μ", part), Model::woven, "grid", part < 1 ? "creep in the last half second" : "μ", part < 1 ? "m" : "1", outcomes[i]);
      row.converged = true;  // motion
      row.reference = part < 1 ? 0 : mu;
      row.measure = part < 1 ? Measure::absolute : Measure::relative;
      row.target = part < 1 ? 2e-5 : 0.001;
      const Table& r = outcomes[i].record;
      const std::size_t n = row_count(r);
      if (outcomes[i].ran && n > 20) {
        const auto at = [&](std::size_t k) { return watched(r, "strip", k).dot(along(strip)); };
        const auto time = r.at("time_s");
        const std::size_t first = n / 2, last = n - 1, middle = (first + last) / 2;
        if (part < 1) {
          row.value = at(last) - at(first);
        } else {
          const double early = (at(middle) - at(first)) / (time[middle] - time[first]), late = (at(last) - at(middle)) / (time[last] - time[middle]);
          const double acceleration = (late - early) / (0.5 * (time[last] - time[first]));
          row.value = std::tan(a) - acceleration / (earth * std::cos(a));
        }
      }
      section.rows.push_back(row);
    }
    return section;
  };
  return e;
}

// ----------------------------------------------------------------------------------------------------------- stick-slip

Experiment stick_slips(const Scope& scope) {
  Experiment e{.test = "stick_slip", .title = "Stick and slip of a pressed strip",
               .about = "A strip of 100 × 10 mm without weight, clamped at one end, the other on a plane across it; the clamp comes down by ε L ([Sano 2017](bibliography.md#sano2017), [Romero 2021](bibliography.md#romero2021)). Its end sticks as "
                        "long as the friction coefficient is above the ratio of the elastica's forces. Equilibria in a row, in steps of 0.5 % of the reference; ε, of the distance between the ends, is the mean of the last step before and the first step after the end has moved by 0.2 % of the length. Above μ = 0.356 it never slips."};
  struct Key {
    double mu, eps;
  };
  std::vector<Key> keys;
  const Strip strip{.length = 0.1, .width = 0.01, .warp = 0, .cell = 0.0025};
  if (scope.woven) {
    const std::vector<StickPoint> curve = stick_slip(0);
    std::vector<double> mus, epss;
    for (const StickPoint& p : curve) {
      mus.push_back(p.friction);
      epss.push_back(p.eps);
    }
    for (const double mu : {0.1, 0.2, 0.3, 0.36, 0.4}) {
      if (scope.quick && mu != 0.2) continue;
      const bool sticks = mu > 0.356;
      const double eps = sticks ? 0.325 : interpolated(mus, epss, mu);
      std::vector<Eigen::Vector3d> moves;
      // The strip's arrow grows with the root of the way.
      for (int i = 0; i <= 40; ++i) moves.push_back(0.5 * i * i / 1600.0 * eps * strip.length * along(strip));
      for (int i = 1; i <= 20; ++i) moves.push_back((0.5 + 0.48 * i / 20) * eps * strip.length * along(strip));
      for (int i = 1; i <= 14; ++i) moves.push_back((0.98 + (sticks ? 0.02 : 0.07) * i / 14) * eps * strip.length * along(strip));
      std::string spec = fmt::format("gravity: 0\ntime_step: 0.2 s\nresidual: 1e-4\nmax_iterations: 4000\nsupport_friction: {}\nincrements: {}\nduration: {} s\nrecord: record.csv\nwatch: [strip.tip]\nconstraints:\n", mu, moves.size() - 1, moves.size() - 1) +
                         path_yaml("clamp", "[strip.clamp]", "clamp", moves);
      // A hair off the straight line, so that it knows where to bend to.
      const std::string hair = "lattices:\n  hair: {low: [-1 m, 0 m, -0.1 m], high: [1 m, 0.1001 m, 0.1 m], cells: [1, 3, 1], basis: bernstein, offsets: [{node: [0, 2, 0], by: [0, 0, 0.05 mm]}, {node: [1, 2, 0], by: [0, 0, 0.05 mm]}, "
                               "{node: [0, 2, 1], by: [0, 0, 0.05 mm]}, {node: [1, 2, 1], by: [0, 0, 0.05 mm]}]}\n";
      Case c = strip_case(fmt::format("woven_{}", mu), strip, {.force_max = 490, .emt_warp = 0.04, .emt_weft = 0.06, .b_warp = 1e-5, .b_weft = 1e-5}, spec, hair);
      mesh::SupportMesh plane = box(1, strip.length + reach, false);
      plane.x.col(0).array() += 0.3;  // the diagonals of its sides away from the strip
      put_on(c, plane);
      e.cases.push_back(c);
      keys.push_back({mu, eps});
    }
  }
  e.judge = [=](const std::vector<Outcome>& outcomes) {
    Section section;
    for (std::size_t i = 0; i < keys.size(); ++i) {
      const auto& [mu, eps] = keys[i];
      const bool sticks = mu > 0.356;
      Row row = row_of("stick_slip", fmt::format("μ = {}", mu), Model::woven, "grid", sticks ? "way of the end up to ε = 0.325, over the length" : "ε at slip", "1", outcomes[i]);
      row.reference = sticks ? 0 : eps;
      row.measure = sticks ? Measure::absolute : Measure::relative;
      row.target = sticks ? 0.002 : 0.01;
      const Table& r = outcomes[i].record;
      if (outcomes[i].ran && row_count(r) > 0) {
        const double start = watched(r, "strip.tip", 0).z();
        const std::vector<double> move = component(r, "clamp", "move", "m", along(strip));
        // Of the distance between the ends while the end sticks; the push of the plane gives a little.
        const auto eps_at = [&](std::size_t k) { return 1 - (watched(r, "strip.tip", k).dot(along(strip)) - move[k]) / strip.length; };
        for (std::size_t k = 0; k < row_count(r) && !row.value; ++k) {
          const double way = std::abs(watched(r, "strip.tip", k).z() - start) / strip.length;
          if (sticks && k + 1 == row_count(r)) row.value = way;
          if (!sticks && way > 0.002) row.value = k == 0 ? eps_at(0) : eps_at(k - 1) + 0.5 * (move[k] - move[k - 1]) / strip.length;
        }
        if (!row.value) row.note = "the end did not let go";
      }
      section.rows.push_back(row);
    }
    return section;
  };
  return e;
}

// ---------------------------------------------------------------------------------------------------------------- drape

struct Shadow {
  double area = 0;  ///< [m2]
  int nodes = 0;
};

/// Shadow of the garment on the plane z = 0, by half millimetres, and the waves of its rim.
Shadow shadow_of(const mesh::GarmentMesh& g, const Eigen::Vector2d& centre) {
  constexpr double pixel = 5e-4;
  constexpr int size = 720;  // 360 mm
  std::vector<char> dark(static_cast<std::size_t>(size) * size, 0);
  const auto to_pixel = [&](double v, double c) { return (v - c) / pixel + 0.5 * size; };
  for (Eigen::Index f = 0; f < g.face_count(); ++f) {
    std::array<Eigen::Vector2d, 3> p;
    for (int k = 0; k < 3; ++k) p[static_cast<std::size_t>(k)] = {to_pixel(g.x(g.faces(f, k), 0), centre.x()), to_pixel(g.x(g.faces(f, k), 1), centre.y())};
    const Eigen::Vector2d low = p[0].cwiseMin(p[1]).cwiseMin(p[2]), high = p[0].cwiseMax(p[1]).cwiseMax(p[2]);
    for (int y = std::max(0, static_cast<int>(low.y())); y <= std::min(size - 1, static_cast<int>(high.y())); ++y) {
      for (int x = std::max(0, static_cast<int>(low.x())); x <= std::min(size - 1, static_cast<int>(high.x())); ++x) {
        const Eigen::Vector2d q(x + 0.5, y + 0.5);
        int left = 0, right = 0;
        for (std::size_t k = 0; k < 3; ++k) {
          const Eigen::Vector2d d = p[(k + 1) % 3] - p[k], w = q - p[k];
          const double side = d.x() * w.y() - d.y() * w.x();
          left += side >= 0;
          right += side <= 0;
        }
        if (left == 3 || right == 3) dark[static_cast<std::size_t>(y) * size + static_cast<std::size_t>(x)] = 1;
      }
    }
  }
  Shadow shadow;
  shadow.area = pixel * pixel * static_cast<double>(std::count(dark.begin(), dark.end(), 1));
  // Rim: farthest dark pixel by direction, smoothed; waves that rise by more than 2 mm.
  constexpr int directions = 360;
  std::vector<double> radius(directions, 0);
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      if (!dark[static_cast<std::size_t>(y) * size + static_cast<std::size_t>(x)]) continue;
      const double dx = x + 0.5 - 0.5 * size, dy = y + 0.5 - 0.5 * size;
      const int d = std::min(directions - 1, static_cast<int>((std::atan2(dy, dx) + pi) / (2 * pi) * directions));
      radius[static_cast<std::size_t>(d)] = std::max(radius[static_cast<std::size_t>(d)], pixel * std::hypot(dx, dy));
    }
  }
  // Turning points with hysteresis, once round and a bit more.
  double extreme = radius[0];
  bool rising = true;
  int start = -1;
  for (int k = 0; k < 3 * directions; ++k) {
    const double r = radius[static_cast<std::size_t>(k % directions)];
    if (rising ? r > extreme : r < extreme) extreme = r;
    if (std::abs(r - extreme) <= 2e-3 || (r > extreme) == rising) continue;
    if (rising) {
      // A crest has been passed.
      if (start < 0 && k >= directions) start = k;
      if (start >= 0 && k < start + directions) ++shadow.nodes;
    }
    rising = !rising;
    extreme = r;
  }
  return shadow;
}

Experiment drape(const Scope& scope) {
  Experiment e{.test = "drape", .title = "Cusick drape", .about =
               "A circle of 300 mm, held flat on a disc of 180 mm ([Cusick 1968](bibliography.md#cusick1968)); drape coefficient = (shadow − disc)/(specimen − disc) in per cent, shadow of the result by half millimetres, and its nodes. The "
               "suiting, elastic. Placements turn the cloth on the disc by 0, 15 and 30°, which gives other grids on the same circle. There is no public complete set of KES-F data with drape of the same bolt, so no row claims a measured fabric; what counts here is what the coefficient owes to mesh, stopping rule, path and placement: less than a point. "
               "Contact of the cloth with the disc's rim from below is left out."};
  struct Key {
    std::string subject, mesh;
    Model model;
    double cell, turn, residual, step;
    Net net;
  };
  std::vector<Key> keys;
  if (!scope.quick) {
    for (const Model model : models(scope)) {
      keys.push_back({"reference: cells of 7.5 mm", "grid", model, 0.0075, 0, 1e-3, 1 / 60.0, Net::grid});
      keys.push_back({"cells of 5 mm", "grid", model, 0.005, 0, 1e-3, 1 / 60.0, Net::grid});
      if (model == Model::particle) continue;
      keys.push_back({"Delaunay", "Delaunay", model, 0.0075, 0, 1e-3, 1 / 60.0, Net::delaunay});
      keys.push_back({"jittered", "jittered", model, 0.0075, 0, 1e-3, 1 / 60.0, Net::jittered});
      keys.push_back({"residual 10⁻⁴", "grid", model, 0.0075, 0, 1e-4, 1 / 60.0, Net::grid});
      keys.push_back({"first step twice as long", "grid", model, 0.0075, 0, 1e-3, 1 / 30.0, Net::grid});
      keys.push_back({"turned by 15°", "grid", model, 0.0075, 15, 1e-3, 1 / 60.0, Net::grid});
      keys.push_back({"turned by 30°", "grid", model, 0.0075, 30, 1e-3, 1 / 60.0, Net::grid});
    }
  }
  for (const Key& k : keys) {
    const double c = 10 * std::cos(k.turn * pi / 180), s = 10 * std::sin(k.turn * pi / 180);
    std::string pattern = fmt::format("name: specimen\nunits: mm\ny: up\npieces:\n  specimen:\n    cut: 1\n    grain: [[0, 0], [{}, {}]]\n    points: {{a: [-150, 0], b: [150, 0]}}\n    outline:\n      - {{name: low, path: [a, {{arc: {{through: [0, -150]}}}}, b]}}\n"
                                      "      - {{name: high, path: [b, {{arc: {{through: [0, 150]}}}}, a]}}\n    lines:\n      disc: {{kind: other, path: [[-90, 0], {{arc: {{through: [0, -90]}}}}, [90, 0], {{arc: {{through: [0, 90]}}}}, [-90, 0]]}}\n",
                                      format_number(c), format_number(s));
    // Panel coordinates are those of the pattern turned until the grain is upright; the disc is a polygon a little outside of its line.
    std::string region;
    for (int i = 0; i < 72; ++i) region += fmt::format("{}[{} m, {} m]", i ? ", " : "", format_number(0.0901 * std::cos(i * pi / 36)), format_number(0.0901 * std::sin(i * pi / 36)));
    std::string spec = fmt::format("model: {}\nresidual: {}\ntime_step: {} s\nmax_iterations: 3000\ngravity_direction: [0, 0, -1]\nwatch: [specimen.disc]\nrecord: record.csv\nconstraints:\n  - {{name: disc, on: [specimen], kind: pin, region: [{}]}}\n",
                                   name_of(k.model), format_number(k.residual), format_number(k.step), region);
    Case one{fmt::format("{}_{}", name_of(k.model), &k - keys.data()), {{"pattern.yaml", pattern}, {"cloth.yaml", fabric_yaml(suiting())}, {"simulation.yaml", spec}}, {}};
    std::vector<std::string> cut{"pattern.yaml", "-o", "panels.ply", "--cell", format_number(1e3 * k.cell) + " mm", "--lines", "['*.disc']"};
    if (k.net == Net::delaunay) cut.insert(cut.end(), {"--mesher", "delaunay"});
    if (k.net == Net::jittered) cut.insert(cut.end(), {"--jitter", "0.25"});
    one.steps = {{"toile-mesh", cut, {}}, {"toile-layer", {"panels.ply", "--fabrics", "cloth.yaml", "--base", "cloth", "-o", "layered.ply"}, {}}, {"toile-simulate", {"layered.ply", "-o", "result.ply", "--spec", "simulation.yaml"}, {}}};
    e.cases.push_back(one);
  }
  e.wants_garments = true;
  e.judge = [=](const std::vector<Outcome>& outcomes) {
    Section section;
    std::optional<double> reference;
    const double disc = pi * 0.09 * 0.09, specimen = pi * 0.15 * 0.15;
    for (std::size_t i = 0; i < keys.size(); ++i) {
      const Key& k = keys[i];
      Row row = row_of("drape", k.subject, k.model, k.mesh, "drape coefficient", "%", outcomes[i]);
      row.measure = Measure::absolute;
      row.target = 1;
      const bool first = i == 0 || keys[i - 1].model != k.model;
      if (first) reference.reset();
      if (outcomes[i].ran && row_count(outcomes[i].record) > 0) {
        const Eigen::Vector3d centre = watched(outcomes[i].record, "specimen.disc", row_count(outcomes[i].record) - 1);
        const Shadow shadow = shadow_of(outcomes[i].garment, centre.head<2>());
        row.value = 100 * (shadow.area - disc) / (specimen - disc);
        row.note = fmt::format("{} nodes", shadow.nodes);
        if (first) reference = row.value;
      }
      row.reference = reference;
      if (first) row.note += row.note.empty() ? "the others are compared with it" : "; the others are compared with it";
      section.rows.push_back(row);
    }
    return section;
  };
  return e;
}

}  // namespace

std::vector<Experiment> shape_tests(const Scope& scope) { return {buckling(scope), friction_cantilever(scope), incline(scope), stick_slips(scope), drape(scope)}; }

}  // namespace toile::lab
