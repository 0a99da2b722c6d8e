#include "cloth_fixtures.h"
#include "toile/base/parallel.h"
#include "toile/mechanics/sheet.h"

#include <Eigen/Geometry>
#include <gtest/gtest.h>
#include <cstring>
#include <functional>

namespace toile::mechanics {
namespace {

using mesh::GarmentMesh;

constexpr double degree = M_PI / 180;
const Points3 no_links(0, 3);

double noise(std::uint64_t& state) {  // in [-1, 1]
  state = state * 6364136223846793005ULL + 1442695040888963407ULL;
  return static_cast<double>(state >> 11) / 4503599627370496.0 - 1;
}

Eigen::Vector3d flat(double u, double v) { return {u, v, 0}; }

/// The shirting of the fixtures with loops: 2HG 2 gf/cm, 2HG5 3.5 gf/cm, 2HB 0.07 and 0.045 gf cm/cm, RT 45 and 60 %.
fabric::Card lossy() {
  fabric::Card card = fixtures::shirting();
  card.shear = 1.0 * 56.188;
  card.shear_hysteresis = 2.0 * 0.980665;
  card.shear_hysteresis_5 = 3.5 * 0.980665;
  card.warp.bending_hysteresis = 0.070 * 9.80665e-3;
  card.weft.bending_hysteresis = 0.045 * 9.80665e-3;
  card.warp.resilience = 0.45;
  card.twist_ratio = 0.3;
  return card;
}

Sheet make(const GarmentMesh& g, const std::vector<int>& directed = {}) {
  SheetOptions options;
  options.directed_vertices = directed;
  options.internal_friction = true;
  const Result<Sheet> sheet = make_sheet(g, mesh::particles(g), options);
  EXPECT_TRUE(sheet) << to_string(sheet.issues().front());
  return *sheet;
}

/// Force is the slope of energy and slope that of the force, apart from the corners; energy has no jumps.
void expect_smooth(const std::function<fabric::CurvePoint(double)>& at, double from, double to, const std::string& what) {
  const int steps = 4000;
  const double h = (to - from) / steps;
  double work = 0, scale = 0, steepest = 0;
  for (int i = 0; i <= 4 * steps; ++i) steepest = std::max(steepest, std::abs(at(from + 0.25 * i * h).slope));
  const double start = at(from).energy;
  for (int i = 0; i < steps; ++i) {
    const double q = from + (i + 0.5) * h;
    work += h * at(q).force;
    scale = std::max(scale, std::abs(work));
    const fabric::CurvePoint a = at(q - 0.01 * h), b = at(q + 0.01 * h);
    EXPECT_NEAR(at(q + 0.5 * h).energy - start, work, 1e-5 * scale + h * h * steepest) << what << " at " << q;
    if (std::abs(b.slope - a.slope) < 1e-6 * (std::abs(a.slope) + std::abs(b.slope))) {
      EXPECT_NEAR((b.force - a.force) / (0.02 * h), at(q).slope, 1e-4 * std::abs(at(q).slope) + 1e-7) << what << " at " << q;
    }
  }
}

TEST(Sliders, ArePotentials) {
  const fabric::Constitutive fabric = *fabric::constitutive(lossy());
  const InternalFriction::Law law = friction_law(fabric);
  for (double anchor : {-80.0, 0.0, 30.0}) {
    MomentSlider slider = moment_slider(fabric, fabric.bending_warp, fabric.hysteresis.moment_warp);
    slider.anchor = anchor;
    expect_smooth([&](double k) { return slider.at(k); }, -300, 300, "moment");
  }
  for (double anchor : {-6 * degree, 0.0, 0.4 * degree, 7.5 * degree}) {
    const ShearSlider slider = shear_slider(law.shear, anchor);
    EXPECT_LT(slider.low, anchor);
    EXPECT_GT(slider.high, anchor);
    expect_smooth([&](double s) { return slider.at(law.shear, s); }, -0.2, 0.2, "shear");
  }
  expect_smooth([&](double s) { return shear_slider(law.shear, 0.3).at(law.shear, s); }, 0.85, 0.999, "shear beyond 70 degrees");
  for (double anchor : {0.0, 3.0, 200.0}) {
    const StretchSlider slider = stretch_slider(fabric.warp, law.loss_warp, anchor);
    expect_smooth([&](double e) { return slider.at(fabric.warp, law.loss_warp, e); }, -0.01, 0.045, "stretch");
  }
}

TEST(Sliders, FollowWithoutAJumpOfTheForce) {
  const fabric::Constitutive fabric = *fabric::constitutive(lossy());
  const InternalFriction::Law law = friction_law(fabric);
  MomentSlider moment = moment_slider(fabric, fabric.bending_warp, fabric.hysteresis.moment_warp);
  ShearSlider shear = shear_slider(law.shear, 0);
  StretchSlider stretch = stretch_slider(fabric.warp, law.loss_warp, 0);
  std::uint64_t state = 9;
  for (int i = 0; i < 200; ++i) {
    const double k = 200 * noise(state), s = 0.15 * noise(state), e = 0.02 + 0.022 * noise(state);
    const double m = moment.at(k).force, t = shear.at(law.shear, s).force, f = stretch.at(fabric.warp, law.loss_warp, e).force;
    moment.anchor = moment.anchor_after(k);
    shear = shear_slider(law.shear, shear.anchor_after(law.shear, s));
    stretch = stretch_slider(fabric.warp, law.loss_warp, stretch.anchor_after(fabric.warp, law.loss_warp, e));
    EXPECT_NEAR(moment.at(k).force, m, 1e-12);
    EXPECT_NEAR(shear.at(law.shear, s).force, t, 1e-9);
    EXPECT_NEAR(stretch.at(fabric.warp, law.loss_warp, e).force, f, 1e-9 * std::abs(f) + 1e-9);
    EXPECT_LE(std::abs(m), moment.limit * (1 + 1e-12));
    EXPECT_LE(std::abs(t), law.shear.limit(std::asin(s)) * (1 + 1e-9));
  }
}

TEST(Friction, GradientAgreesWithDifferences) {
  for (const fixtures::Net net : {fixtures::Net::alternating, fixtures::Net::jittered}) {
    const GarmentMesh g = fixtures::net(net, 5, 4, 0.05, 0.04, lossy(), [](double u, double v) { return Eigen::Vector3d(u, v, 8 * u * u - 3 * u * v); });
    Sheet sheet = make(g, {0, 6, 12});
    std::uint64_t state = 3;
    Points3 x(sheet.node_count, 3), before = x;
    x.topRows(g.vertex_count()) = g.x;
    for (const Director& d : sheet.directors) {
      x.row(d.ghost_u) = x.row(d.node) + d.length * Eigen::RowVector3d(1, 0, 0.3);
      x.row(d.ghost_v) = x.row(d.node) + d.length * Eigen::RowVector3d(0, 1, -0.1);
    }
    before = x;
    for (Eigen::Index i = 0; i < x.size(); ++i) before.data()[i] += 0.0002 * noise(state);
    advance_friction(sheet, before);
    for (Eigen::Index i = 0; i < x.size(); ++i) x.data()[i] += 0.0002 * noise(state);
    SheetResponse r;
    evaluate(sheet, x, no_links, {}, r);
    EXPECT_NEAR(r.energy.total(), energy(sheet, x, no_links).total(), 1e-12 * r.energy.total());
    const double h = 1e-8;
    double worst = 0;
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      Points3 up = x, down = x;
      up.data()[i] += h;
      down.data()[i] -= h;
      worst = std::max(worst, std::abs((energy(sheet, up, no_links).total() - energy(sheet, down, no_links).total()) / (2 * h) - r.gradient.data()[i]));
    }
    EXPECT_LT(worst, 1e-5 * r.gradient.norm()) << fixtures::name_of(net);
    // Bending alone: against the membrane its forces would not show.
    Sheet bending = sheet;
    for (fabric::Constitutive& f : bending.fabrics) {
      f.warp = f.weft = fabric::tensile_curve(1e-6, 1, 1);
      f.shear.rigidity = 1e-9;
    }
    for (InternalFriction::Law& law : bending.friction->laws) law = {};
    evaluate(bending, x, no_links, {}, r);
    worst = 0;
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      Points3 up = x, down = x;
      up.data()[i] += h;
      down.data()[i] -= h;
      worst = std::max(worst, std::abs((energy(bending, up, no_links).total() - energy(bending, down, no_links).total()) / (2 * h) - r.gradient.data()[i]));
    }
    EXPECT_LT(worst, 2e-4 * r.gradient.norm()) << fixtures::name_of(net);
  }
}

/// In the plane, where sliders of bending have no force, the second derivative is the whole one but for the turn of their normals.
TEST(Friction, HessianAgreesWithDifferencesAndItsProjectionIsPositive) {
  for (const fixtures::Net net : {fixtures::Net::alternating, fixtures::Net::jittered}) {
    const GarmentMesh g = fixtures::net(net, 4, 4, 0.04, 0.04, lossy(), flat);
    Sheet sheet = make(g);
    std::uint64_t state = 5;
    Points3 x = g.x, before = g.x;
    for (Eigen::Index i = 0; i < x.rows(); ++i) {
      before.row(i) = Eigen::RowVector3d(1.012 * g.x(i, 0) + 0.05 * g.x(i, 1), 1.006 * g.x(i, 1), 0);
      x.row(i) = before.row(i) + 0.00004 * Eigen::RowVector3d(noise(state), noise(state), 0);
    }
    advance_friction(sheet, before);
    SheetResponse r;
    evaluate(sheet, x, no_links, Curvature::exact, r);
    const double h = 1e-9;
    double worst = 0;
    int corners = 0;  // differences over a slider's corner say nothing
    const double scale = r.matrix.value[0].matrix().norm();
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      Points3 up = x, down = x;
      up.data()[i] += h;
      down.data()[i] -= h;
      SheetResponse ru, rd;
      evaluate(sheet, up, no_links, {}, ru);
      evaluate(sheet, down, no_links, {}, rd);
      const Points3 column = (ru.gradient - rd.gradient) / (2 * h);
      Points3 stored = Points3::Zero(x.rows(), 3);
      const int col = static_cast<int>(i / 3), axis = static_cast<int>(i % 3);
      for (int row = 0; row < r.matrix.rows(); ++row) {
        for (int k = r.matrix.row_start[static_cast<std::size_t>(row)]; k < r.matrix.row_start[static_cast<std::size_t>(row) + 1]; ++k) {
          if (r.matrix.column[static_cast<std::size_t>(k)] == col) stored.row(row) = r.matrix.value[static_cast<std::size_t>(k)].matrix().col(axis).transpose();
        }
      }
      if ((column - stored).norm() > 1e-4 * scale) {
        ++corners;
      } else {
        worst = std::max(worst, (column - stored).norm());
      }
    }
    EXPECT_LE(corners, 2) << fixtures::name_of(net);
    EXPECT_LT(worst, 1e-4 * scale);
    // Positive in random directions, and symmetric.
    evaluate(sheet, x, no_links, Curvature::positive, r);
    for (int trial = 0; trial < 50; ++trial) {
      Points3 p(x.rows(), 3), q(x.rows(), 3), ap = Points3::Zero(x.rows(), 3);
      for (Eigen::Index i = 0; i < p.size(); ++i) p.data()[i] = noise(state), q.data()[i] = noise(state);
      double qap = 0, paq = 0, pap = 0;
      for (int row = 0; row < r.matrix.rows(); ++row) {
        for (int k = r.matrix.row_start[static_cast<std::size_t>(row)]; k < r.matrix.row_start[static_cast<std::size_t>(row) + 1]; ++k) {
          const Eigen::Matrix3d m = r.matrix.value[static_cast<std::size_t>(k)].matrix();
          const int c = r.matrix.column[static_cast<std::size_t>(k)];
          qap += q.row(row) * m * p.row(c).transpose();
          paq += p.row(row) * m * q.row(c).transpose();
          pap += p.row(row) * m * p.row(c).transpose();
        }
      }
      EXPECT_NEAR(qap, paq, 1e-5 * std::abs(pap));
      EXPECT_GT(pap, 0);
    }
  }
}

/// A quantity over a path, and what a test reads of its loop: linear between the steps.
struct Branch {
  std::vector<double> at, value;
  double operator()(double where) const {
    for (std::size_t i = 1; i < at.size(); ++i) {
      if ((at[i - 1] - where) * (at[i] - where) <= 0 && at[i] != at[i - 1]) return value[i - 1] + (value[i] - value[i - 1]) * (where - at[i - 1]) / (at[i] - at[i - 1]);
    }
    ADD_FAILURE() << where << " is not on the branch";
    return 0;
  }
};

/// KES-F tension: out to F_max and back; EMT, LT, WT, RT.
TEST(VirtualKes, TensionGivesTheCardBack) {
  const fabric::Card card = lossy();
  for (const fixtures::Net net : {fixtures::Net::alternating, fixtures::Net::jittered, fixtures::Net::delaunay}) {
    for (const bool warp : {false, true}) {
      const GarmentMesh g = fixtures::net(net, 8, 8, 0.05, 0.05, card, flat);
      Sheet sheet = make(g);
      const fabric::YarnDirection& yarn = warp ? card.warp : card.weft;
      const auto force = [&](double e) {
        Points3 x = g.x;
        for (Eigen::Index i = 0; i < x.rows(); ++i) x.row(i) = Eigen::RowVector3d(g.uv(i, 0) * (warp ? 1 : 1 + e), g.uv(i, 1) * (warp ? 1 + e : 1), 0);
        SheetResponse r;
        evaluate(sheet, x, no_links, {}, r);
        double sum = 0;
        for (Eigen::Index i = 0; i < x.rows(); ++i) sum += r.gradient.row(i).dot(Eigen::RowVector3d(warp ? 0 : g.uv(i, 0), warp ? g.uv(i, 1) : 0, 0));
        advance_friction(sheet, x);
        return sum / (0.05 * 0.05);
      };
      const int steps = 200;
      double out = 0, back = 0, emt = 0, last_e = 0, last_f = 0;
      for (int i = 1; i <= steps; ++i) {
        const double e = 1.02 * yarn.strain_max * i / steps, f = force(e);
        if (last_f < card.tensile_force_max && f >= card.tensile_force_max) {
          const double t = (card.tensile_force_max - last_f) / (f - last_f);
          emt = last_e + t * (e - last_e);
          out += 0.5 * (last_f + card.tensile_force_max) * (emt - last_e);
          break;
        }
        out += 0.5 * (last_f + f) * (e - last_e);
        last_e = e;
        last_f = f;
      }
      EXPECT_NEAR(emt / yarn.strain_max, 1, 0.01) << fixtures::name_of(net) << warp;
      EXPECT_NEAR(2 * out / (card.tensile_force_max * emt) / yarn.linearity, 1, 0.01) << fixtures::name_of(net);
      last_e = emt;
      last_f = force(emt);
      for (int i = steps; i-- > 0;) {
        const double e = emt * i / steps, f = force(e);
        back += 0.5 * (last_f + f) * (last_e - e);
        last_e = e;
        last_f = f;
      }
      EXPECT_NEAR(back / out / yarn.resilience, 1, 0.03) << fixtures::name_of(net);
    }
  }
}

/// KES-F shear between +-8 degrees; G, 2HG, 2HG5.
TEST(VirtualKes, ShearGivesTheCardBack) {
  const fabric::Card card = lossy();
  for (const fixtures::Net net : {fixtures::Net::alternating, fixtures::Net::jittered}) {
    const GarmentMesh g = fixtures::net(net, 8, 8, 0.05, 0.05, card, flat);
    Sheet sheet = make(g);
    const auto force = [&](double angle) {
      Points3 x = g.x;
      double sum = 0;
      for (Eigen::Index i = 0; i < x.rows(); ++i) x.row(i) = Eigen::RowVector3d(g.uv(i, 0) + g.uv(i, 1) * std::sin(angle), g.uv(i, 1) * std::cos(angle), 0);
      SheetResponse r;
      evaluate(sheet, x, no_links, {}, r);
      for (Eigen::Index i = 0; i < x.rows(); ++i) sum += r.gradient.row(i).dot(g.uv(i, 1) * Eigen::RowVector3d(std::cos(angle), -std::sin(angle), 0));
      advance_friction(sheet, x);
      return sum / (0.05 * 0.05 * std::cos(angle));
    };
    std::array<Branch, 4> branch;  // 0 to 8, to 0, to -8, to 0
    const std::array<double, 5> turn{0, 8, 0, -8, 0};
    for (std::size_t b = 0; b < 4; ++b) {
      for (int i = 0; i <= 160; ++i) {
        const double a = (turn[b] + (turn[b + 1] - turn[b]) * i / 160) * degree;
        branch[b].at.push_back(a);
        branch[b].value.push_back(force(a));
      }
    }
    const double up = (branch[0](2.5 * degree) - branch[0](0.5 * degree)) / (2 * degree), down = (branch[2](-0.5 * degree) - branch[2](-2.5 * degree)) / (2 * degree);
    EXPECT_NEAR(0.5 * (up + down) / card.shear, 1, 0.01) << fixtures::name_of(net);
    EXPECT_NEAR((branch[0](0.5 * degree) - branch[1](0.5 * degree)) / card.shear_hysteresis, 1, 0.01);
    EXPECT_NEAR((branch[3](-0.5 * degree) - branch[2](-0.5 * degree)) / card.shear_hysteresis, 1, 0.01);
    EXPECT_NEAR((branch[0](5 * degree) - branch[1](5 * degree)) / card.shear_hysteresis_5, 1, 0.01);
  }
}

/// Moment of a cylinder about an axis at an angle to the weft, as the slope of its energy by the curvature; the sheet takes note.
struct Bender {
  explicit Bender(fixtures::Net net, const fabric::Card& card, double angle) : direction(std::cos(angle), std::sin(angle)) {
    garment = fixtures::net(net, 10, 10, 0.01, 0.01, card, flat);
    std::vector<int> directed;
    for (int v = 0; v < garment.vertex_count(); ++v) {
      const double u = garment.uv(v, 0), w = garment.uv(v, 1);
      if (std::min({u, w, 0.01 - u, 0.01 - w}) < 1e-9) directed.push_back(v);
    }
    sheet = make(garment, directed);
  }
  Points3 bent(double curvature) const {
    // Second derivatives like those of the cylinder, quadratic, so that there is no error of the mesh.
    Points3 x(sheet.node_count, 3);
    const auto height = [&](double u, double v) { return 0.5 * curvature * std::pow(direction.x() * u + direction.y() * v, 2); };
    for (Eigen::Index i = 0; i < garment.vertex_count(); ++i) x.row(i) << garment.uv(i, 0), garment.uv(i, 1), height(garment.uv(i, 0), garment.uv(i, 1));
    for (const Director& d : sheet.directors) {
      const double slope = curvature * (direction.x() * garment.uv(d.vertex, 0) + direction.y() * garment.uv(d.vertex, 1));
      x.row(d.ghost_u) = x.row(d.node) + d.length * Eigen::RowVector3d(1, 0, slope * direction.x());
      x.row(d.ghost_v) = x.row(d.node) + d.length * Eigen::RowVector3d(0, 1, slope * direction.y());
    }
    return x;
  }
  double moment(double curvature) {
    const double h = 1e-3;
    const double m = (energy(sheet, bent(curvature + h), no_links).bending - energy(sheet, bent(curvature - h), no_links).bending) / (2 * h) / 1e-4;
    advance_friction(sheet, bent(curvature));
    return m;
  }
  Eigen::Vector2d direction;
  GarmentMesh garment;
  Sheet sheet;
};

/// A flat element of a cylinder: normals hardly turn over it, as the height is a small part of the curvature's radius.
TEST(VirtualKes, BendingGivesTheCardBack) {
  const fabric::Card card = lossy();
  for (const fixtures::Net net : {fixtures::Net::alternating, fixtures::Net::single, fixtures::Net::jittered, fixtures::Net::delaunay}) {
    for (double angle : {0.0, 45.0, 90.0}) {
      const double c = std::cos(angle * degree), s = std::sin(angle * degree);
      const double b = std::pow(c, 4) * card.weft.bending + std::pow(s, 4) * card.warp.bending + 4 * c * c * s * s * 0.3 * std::sqrt(card.weft.bending * card.warp.bending);
      const double loop = c * c * card.weft.bending_hysteresis + s * s * card.warp.bending_hysteresis;
      Bender bender(net, card, angle * degree);
      // The curvatures are a hundredth of KES-F's, so that the surface stays flat, and so are the loops.
      for (InternalFriction::Bending& f : bender.sheet.friction->bending) f.slider.limit *= 0.01;
      std::array<Branch, 2> branch;
      const std::array<double, 3> turn{0, 2.5, -2.5};
      for (std::size_t k = 0; k < 2; ++k) {
        for (int i = 0; i <= 50; ++i) {
          const double curvature = turn[k] + (turn[k + 1] - turn[k]) * i / 50;
          branch[k].at.push_back(curvature);
          branch[k].value.push_back(bender.moment(curvature));
        }
      }
      EXPECT_NEAR((branch[0](1.5) - branch[0](0.5)) / b, 1, 0.01) << fixtures::name_of(net) << ' ' << angle;
      EXPECT_NEAR((branch[0](1) - branch[1](1)) / (0.01 * loop), 1, 0.01) << fixtures::name_of(net) << ' ' << angle;
      // Let go: where the moment vanishes on the way back.
      double low = -2.5, high = 2.5;
      for (int i = 0; i < 60; ++i) {
        const double middle = 0.5 * (low + high);
        (branch[1](middle) > 0 ? high : low) = middle;
      }
      EXPECT_NEAR(0.5 * (low + high) / (0.01 * loop / (2 * b)), 1, 0.02) << fixtures::name_of(net) << ' ' << angle;
    }
  }
}

TEST(Friction, TurningAndStoringChangeNothing) {
  for (const fixtures::Net net : {fixtures::Net::alternating, fixtures::Net::jittered}) {
    GarmentMesh g = fixtures::net(net, 8, 6, 0.08, 0.06, lossy(), [](double u, double v) { return Eigen::Vector3d(1.01 * u, v + 0.1 * u, 20 * u * v - 5 * v * v); });
    const std::vector<int> directed{0, 9, 18};
    Sheet sheet = make(g, directed);
    Points3 x(sheet.node_count, 3);
    x.topRows(g.vertex_count()) = g.x;
    for (const Director& d : sheet.directors) {
      x.row(d.ghost_u) = x.row(d.node) + d.length * Eigen::RowVector3d(1, 0, 0.2);
      x.row(d.ghost_v) = x.row(d.node) + d.length * Eigen::RowVector3d(0, 1, 0.1);
    }
    advance_friction(sheet, x);
    Points3 relaxed = x;
    relaxed.col(2) *= 0.97;
    relaxed.col(0) *= 0.998;
    SheetResponse a, b, c;
    evaluate(sheet, relaxed, no_links, {}, a);
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, 2, -0.5).normalized()).toRotationMatrix();
    const Points3 moved = (relaxed * turn.transpose()).rowwise() + Eigen::RowVector3d(0.4, -1.2, 0.7);
    Sheet turned = sheet;
    advance_friction(turned, (x * turn.transpose()).eval());
    evaluate(turned, moved, no_links, {}, b);
    EXPECT_NEAR(a.energy.total(), b.energy.total(), 1e-9 * a.energy.total());
    EXPECT_LT((a.gradient * turn.transpose() - b.gradient).norm(), 1e-8 * a.gradient.norm());
    // Through the columns: the same bits.
    store_friction(sheet, g);
    EXPECT_TRUE(mesh::validate(g).empty());
    const Sheet again = make(g, directed);
    evaluate(again, relaxed, no_links, {}, c);
    EXPECT_EQ(a.energy.total(), c.energy.total());
    EXPECT_TRUE(a.gradient == c.gradient);
    GarmentMesh second = g;
    store_friction(again, second);
    EXPECT_EQ(second.vertex_columns.at("slip_warp_plus").reals, g.vertex_columns.at("slip_warp_plus").reals);
    EXPECT_EQ(second.face_columns.at("slip_shear").reals, g.face_columns.at("slip_shear").reals);
    EXPECT_EQ(second.face_columns.count("slip_pair_weft"), net == fixtures::Net::jittered ? 1u : 0u);
    // Without the clamp: both sides of its vertices were the same, or their mean is taken.
    const Sheet released = make(g);
    EXPECT_FALSE(released.friction->bending.empty());
    // A sheet without friction takes the columns off.
    store_friction(*make_sheet(g, mesh::particles(g), {}), g);
    EXPECT_TRUE(g.vertex_columns.empty());
    EXPECT_TRUE(g.face_columns.empty());
  }
}

TEST(Friction, SameBitsAtAnyThreadCount) {
  const GarmentMesh g = fixtures::net(fixtures::Net::delaunay, 40, 40, 0.4, 0.4, lossy(), [](double u, double v) { return Eigen::Vector3d(u, v, 0.02 * std::sin(20 * u) * std::cos(13 * v)); });
  std::array<SheetResponse, 3> r;
  std::size_t k = 0;
  for (int threads : {1, 2, 5}) {
    set_thread_count(threads);
    Sheet sheet = make(g);
    advance_friction(sheet, g.x);
    Points3 x = g.x;
    x.col(2) *= 0.98;
    evaluate(sheet, x, no_links, Curvature::positive, r[k++]);
  }
  set_thread_count(0);
  for (std::size_t i = 1; i < 3; ++i) {
    EXPECT_EQ(r[i].energy.total(), r[0].energy.total());
    EXPECT_TRUE(r[i].gradient == r[0].gradient);
    EXPECT_EQ(std::memcmp(r[i].matrix.value.data(), r[0].matrix.value.data(), r[i].matrix.value.size() * sizeof(Block)), 0);
  }
}

TEST(Friction, WithoutLoopsThereIsNone) {
  fabric::Card card = fixtures::shirting();
  card.warp.resilience = card.weft.resilience = 1;
  const GarmentMesh g = fixtures::sheet(6, 6, 0.06, 0.06, card, [](double u, double v) { return Eigen::Vector3d(1.01 * u, v + 0.1 * u, 20 * u * v); });
  SheetResponse a, b;
  evaluate(make(g), g.x, no_links, Curvature::positive, a);
  evaluate(*make_sheet(g, mesh::particles(g), {}), g.x, no_links, Curvature::positive, b);
  EXPECT_EQ(a.energy.total(), b.energy.total());
  EXPECT_TRUE(a.gradient == b.gradient);
}

}  // namespace
}  // namespace toile::mechanics
