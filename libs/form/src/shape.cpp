#include "shape.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace toile::form {

using Eigen::Vector3d;

namespace {

constexpr double pi = std::numbers::pi;

/// Cubic smooth minimum: equal to the minimum where the two differ by more than k, C2 everywhere.
double smooth_min(double a, double b, double k) {
  const double h = std::max(k - std::abs(a - b), 0.0) / k;
  return std::min(a, b) - h * h * h * k / 6;
}
double smooth_max(double a, double b, double k) { return -smooth_min(-a, -b, k); }

/// Monotone piecewise cubic through knots (Fritsch and Carlson's choice of slopes).
double monotone_cubic(const std::vector<std::pair<double, double>>& knots, double s) {
  const std::size_t n = knots.size();
  if (s <= knots.front().first) return knots.front().second;
  if (s >= knots.back().first) return knots.back().second;
  std::size_t i = 0;
  while (s > knots[i + 1].first) ++i;
  const auto secant = [&](std::size_t k) { return (knots[k + 1].second - knots[k].second) / (knots[k + 1].first - knots[k].first); };
  const auto slope = [&](std::size_t k) {
    if (k == 0 || k == n - 1) return 0.0;
    const double a = secant(k - 1), b = secant(k);
    if (a * b <= 0) return 0.0;
    const double ha = knots[k].first - knots[k - 1].first, hb = knots[k + 1].first - knots[k].first;
    const double wa = 2 * hb + ha, wb = hb + 2 * ha;
    return (wa + wb) / (wa / a + wb / b);
  };
  const double h = knots[i + 1].first - knots[i].first, t = (s - knots[i].first) / h;
  const double t2 = t * t, t3 = t2 * t;
  return (2 * t3 - 3 * t2 + 1) * knots[i].second + (t3 - 2 * t2 + t) * h * slope(i) + (-2 * t3 + 3 * t2) * knots[i + 1].second +
         (t3 - t2) * h * slope(i + 1);
}

/// 0 behind, 1 in front, smooth over about `width`.
double frontness(double s, double width) { return 0.5 * (1 + s / std::sqrt(s * s + width * width)); }

}  // namespace

Profile::Profile(const std::vector<std::pair<double, double>>& knots, double round) {
  step_ = round / 2.5;
  low_ = knots.front().first - 4 * step_;
  const int n = static_cast<int>(std::ceil((knots.back().first - low_) / step_)) + 5;
  std::vector<double> raw;
  const int reach = 8;
  for (int i = -reach; i < n + reach; ++i) raw.push_back(monotone_cubic(knots, low_ + i * step_));
  for (int i = 0; i < n; ++i) {
    double sum = 0, weight = 0;
    for (int j = -reach; j <= reach; ++j) {
      const double w = std::exp(-0.5 * j * j / (2.5 * 2.5));
      sum += w * raw[static_cast<std::size_t>(i + j + reach)];
      weight += w;
    }
    values_.push_back(sum / weight);
  }
}

Profile::Value Profile::at(double s) const {
  const double u = std::clamp((s - low_) / step_, 0.0, static_cast<double>(values_.size() - 1));
  const int last = static_cast<int>(values_.size()) - 1;
  const int i = std::min(static_cast<int>(u), last - 1);
  const double t = u - i;
  const auto v = [&](int k) { return values_[static_cast<std::size_t>(std::clamp(k, 0, last))]; };
  const double a = v(i - 1), b = v(i), c = v(i + 1), d = v(i + 2);
  const double t2 = t * t, t3 = t2 * t;
  const double f = ((1 - 3 * t + 3 * t2 - t3) * a + (4 - 6 * t2 + 3 * t3) * b + (1 + 3 * t + 3 * t2 - 3 * t3) * c + t3 * d) / 6;
  const double g = ((-1 + 2 * t - t2) * a + (-4 * t + 3 * t2) * b + (1 + 2 * t - 3 * t2) * c + t2 * d) / 2;
  return {f, g / step_};
}

Tuning first_tuning(const Measurements& m, const FormParams& params) {
  Tuning t;
  t.hps_height = 0.94 * m.hpsToWaistBack;
  t.slope = m.shoulderSlope;
  t.bust_height = t.hps_height - 0.95 * m.hpsToBust;
  t.arm_root = 0.02 * m.hpsToWaistBack / 0.46;
  t.elbow = m.shoulderToElbow - 0.02;
  t.hand = m.shoulderToWrist - 0.02;
  (void)params;
  return t;
}

void Shape::bump(double x, double y, double z, double sx, double sy, double sz, double height) {
  const double u = levels_.unit;
  bumps_.push_back({{x * u, y, z}, {sx * u, sy * u, sz * u}, height * u});
}

Shape::Shape(const Measurements& m, const FormParams& params, const Tuning& tuning) : params_(params) {
  const bool male = params.sex == Sex::male;
  Levels& l = levels_;
  const double u = l.unit = 0.5 * (m.chest / (male ? 1.0 : 0.92) + m.hpsToWaistBack / (male ? 0.46 : 0.42));

  l.waist = m.waistToFloor;
  l.hips = l.waist - m.waistToHips;
  l.seat = l.waist - m.waistToSeat;
  const double leg = m.waistToUpperLeg ? l.waist - *m.waistToUpperLeg : l.seat - 0.06 * u;
  l.bottom = std::min(leg, l.seat - 0.05 * u) - 0.035 * u;
  if (params.legs) {
    const double crotch = *m.inseam;
    l.crotch = crotch;
    l.thigh = crotch - 0.06 * u;
    l.knee = m.waistToKnee ? l.waist - *m.waistToKnee : 0.57 * crotch;
    l.ankle = 0.1 * crotch;
    l.calf = l.ankle + 0.68 * (l.knee - l.ankle);
    l.floor = l.ankle - 0.02 * u;
    // The trunk's floor lies inside the legs; the crotch is where the legs meet below it.
    l.bottom = crotch - tuning.crotch + 0.004 * u;
  }
  l.hps = l.waist + tuning.hps_height;
  l.armpit = l.waist + m.waistToArmpit;
  l.bust = l.waist + tuning.bust_height;
  l.chest = std::min(l.bust, l.armpit - 0.02 * u);  // a tape round the chest passes under the arms
  l.underbust = m.waistToUnderbust ? std::min(l.waist + *m.waistToUnderbust, l.chest - 0.045 * u) : l.waist + 0.55 * (l.chest - l.waist);
  l.half_shoulder = m.shoulderToShoulder / 2;

  const double neck = m.neck * tuning.neck;
  const double neck_half = 0.147 * neck;
  const double slope = std::tan(tuning.slope);
  l.shoulder = l.hps - slope * (l.half_shoulder - neck_half);

  // ---- sections along the spine ----
  const double chest = m.chest * tuning.chest, waist = m.waist * tuning.waist, hips = m.hips * tuning.hips, seat = m.seat * tuning.seat;
  const double ribs_asked = m.underbust.value_or(male ? 0.5 * (m.chest + m.waist) * 1.0 : 0.45 * m.waist + 0.55 * (m.chest - 0.06 * u));
  const double ribs = ribs_asked * tuning.underbust;
  // The rib cage under the breasts carries on from the underbust; without breasts it is the chest itself.
  const double cage = male ? chest : std::min(0.96 * m.chest, m.highBust ? 0.5 * ribs_asked + 0.52 * *m.highBust : 1.07 * ribs_asked);
  const double belly = std::clamp((m.waist / m.chest - (male ? 0.8 : 0.76)) * 0.14, -0.01, 0.05);
  // With arms the torso ends inside the shoulder; without them it goes beyond, and the armhole's plate cuts it.
  const double tip = l.half_shoulder + (params.arms ? -0.022 * u : 0.05 * u);
  const double axilla = l.shoulder - 0.062 * u;
  const double under_seat = l.seat - 0.055 * u;

  const double lowest = params.legs ? std::min(l.bottom, under_seat) - 0.03 * u : l.bottom - 0.03 * u;

  struct Level {
    double y, width, front, back, centre, front_power, back_power;
  };
  std::vector<Level> levels;
  const double upper_chest = l.chest + 0.45 * (axilla - l.chest);
  if (male) {
    levels = {
        {lowest, 0.160 * seat, 0.086 * seat, 0.076 * seat, 0.024 * u, 2.3, 2.3},
        {under_seat, 0.187 * seat, 0.096 * seat, 0.102 * seat, 0.024 * u, 2.3, 2.3},
        {l.seat, 0.190 * seat, 0.100 * seat, 0.121 * seat, 0.023 * u, 2.3, 2.35},
        {l.hips, 0.180 * hips, 0.111 * hips, 0.127 * hips, 0.028 * u, 2.35, 2.35},
        {l.waist, 0.181 * waist, (0.122 + belly) * waist, (0.120 - 0.4 * belly) * waist, 0.038 * u, 2.3, 2.3},
        {l.underbust, 0.176 * ribs, 0.121 * ribs, 0.125 * ribs, 0.037 * u, 2.35, 2.3},
        {l.chest, 0.176 * chest, 0.118 * chest, 0.117 * chest, 0.031 * u, 2.5, 2.5},
        {upper_chest, 0.5 * (0.178 * chest + tip - 0.016 * u), 0.115 * chest, 0.116 * chest, 0.026 * u, 2.5, 2.6},
        {axilla, tip - 0.016 * u, 0.106 * chest, 0.109 * chest, 0.020 * u, 2.4, 2.6},
        {l.shoulder, tip, 0.083 * chest, 0.092 * chest, 0.014 * u, 2.2, 2.4},
        {l.hps + 0.004 * u, tip + 0.03 * u, 0.150 * neck, 0.150 * neck, 0.022 * u, 2.05, 2.0},
        {l.hps + 0.045 * u, tip + 0.03 * u, 0.158 * neck, 0.150 * neck, 0.036 * u, 2.0, 2.0},
        {l.hps + 0.13 * u, tip + 0.03 * u, 0.158 * neck, 0.154 * neck, 0.064 * u, 2.0, 2.0},
    };
  } else {
    levels = {
        {lowest, 0.164 * seat, 0.084 * seat, 0.076 * seat, 0.020 * u, 2.25, 2.25},
        {under_seat, 0.192 * seat, 0.092 * seat, 0.104 * seat, 0.018 * u, 2.25, 2.25},
        {l.seat, 0.193 * seat, 0.097 * seat, 0.122 * seat, 0.016 * u, 2.25, 2.3},
        {l.hips, 0.186 * hips, 0.110 * hips, 0.124 * hips, 0.022 * u, 2.25, 2.25},
        {l.waist, 0.184 * waist, (0.120 + belly) * waist, (0.112 - 0.4 * belly) * waist, 0.034 * u, 2.2, 2.2},
        {l.underbust, 0.179 * ribs, 0.117 * ribs, 0.121 * ribs, 0.031 * u, 2.3, 2.3},
        {l.chest, 0.177 * cage, 0.112 * cage, 0.122 * cage, 0.026 * u, 2.4, 2.45},
        {upper_chest, 0.5 * (0.178 * cage + tip - 0.016 * u), 0.105 * cage, 0.121 * cage, 0.021 * u, 2.4, 2.5},
        {axilla, tip - 0.016 * u, 0.094 * cage, 0.114 * cage, 0.016 * u, 2.35, 2.5},
        {l.shoulder, tip, 0.074 * cage, 0.092 * cage, 0.012 * u, 2.2, 2.3},
        {l.hps + 0.004 * u, tip + 0.03 * u, 0.150 * neck, 0.150 * neck, 0.018 * u, 2.05, 2.0},
        {l.hps + 0.045 * u, tip + 0.03 * u, 0.158 * neck, 0.152 * neck, 0.032 * u, 2.0, 2.0},
        {l.hps + 0.13 * u, tip + 0.03 * u, 0.158 * neck, 0.154 * neck, 0.060 * u, 2.0, 2.0},
    };
  }
  const auto profile = [&](double Level::*member, double round) {
    std::vector<std::pair<double, double>> knots;
    for (const Level& level : levels) knots.emplace_back(level.y, level.*member);
    return Profile(knots, round * u);
  };
  const Profile wide = profile(&Level::width, 0.024);
  front_ = profile(&Level::front, 0.024);
  back_ = profile(&Level::back, 0.024);
  centre_ = profile(&Level::centre, 0.026);
  front_power_ = profile(&Level::front_power, 0.02);
  back_power_ = profile(&Level::back_power, 0.02);
  // The shoulder line: a slope that leaves the neck in a hollow curve and is rounded off at the shoulder.
  const double hollow = 0.020 * u;
  width_ = Profile::sampled(lowest - 0.02 * u, l.hps + 0.15 * u, 0.004 * u, [&](double y) {
    const double run = (l.hps - y) / slope / hollow;
    const double line = neck_half + hollow * (run > 30 ? run : std::log1p(std::exp(run)));
    return smooth_min(line, wide.at(y).f, 0.06 * u);
  });

  // ---- neck ----
  const double tilt = 24 * pi / 180;
  l.neck_normal = {0, std::cos(tilt), std::sin(tilt)};
  l.neck_point = {0, l.hps, centre_.at(l.hps).f - 0.008 * u};
  l.collar_point = l.neck_point + 0.012 * u * l.neck_normal;
  l.top = l.hps + 0.075 * u;

  // ---- arms ----
  const double angle = params.arm_angle, forward = 0.05;
  l.arm_direction = Vector3d(std::cos(angle), -std::sin(angle), forward).normalized();
  l.arm_outer = Vector3d(std::sin(angle), std::cos(angle), 0);
  const double upper = m.biceps * tuning.biceps / (2 * pi), wrist = m.wrist * tuning.wrist / (2 * pi);
  // The underarm: let down by a deeper root and a wider blend, drawn up by the contrary.
  const double root = tuning.arm_root;
  arm_blend_ = std::clamp(0.075 * u + 0.8 * root, 0.03 * u, 0.12 * u);
  l.arm_joint = {l.half_shoulder - 0.036 * u, l.shoulder - 0.055 * u - 0.4 * std::min(root, 0.0), 0.012 * u};
  l.elbow = tuning.elbow;
  l.hand = tuning.hand;
  l.biceps = 0.52 * l.elbow;
  struct Ring {
    double s, high, low, deep;
  };
  const double e = l.elbow, h = l.hand;
  const std::vector<Ring> rings = {
      {-0.10 * u, 0.060 * u, 0.062 * u, 1.18 * upper}, {0.0, 0.062 * u, 0.062 * u, 1.24 * upper},
      {0.12 * e, 0.030 * u + 0.62 * upper, 0.028 * u + 0.60 * upper, 1.22 * upper}, {0.30 * e, 1.14 * upper, 1.05 * upper, 1.14 * upper},
      {0.52 * e, 0.98 * upper, 1.0 * upper, 1.02 * upper}, {0.80 * e, 0.86 * upper, 0.86 * upper, 0.90 * upper}, {e, 0.80 * upper, 0.80 * upper, 0.86 * upper},
      {e + 0.25 * (h - e), 0.82 * upper, 0.80 * upper, 0.86 * upper}, {e + 0.65 * (h - e), 0.4 * upper + 0.5 * wrist, 0.4 * upper + 0.5 * wrist, 0.44 * upper + 0.5 * wrist},
      {h, 0.88 * wrist, 0.88 * wrist, 1.11 * wrist}, {h + 0.05 * u, 0.9 * wrist, 0.9 * wrist, 1.15 * wrist}};
  const auto arm_profile = [&](double Ring::*member, double drop) {
    std::vector<std::pair<double, double>> knots;
    for (const Ring& ring : rings) knots.emplace_back(ring.s, ring.*member);
    const Profile plain(knots, 0.014 * u);
    return Profile::sampled(-0.12 * u, h + 0.06 * u, 0.005 * u, [&](double s) {
      const double r = plain.at(s).f, thinnest = std::min(0.6 * upper - r, 0.0);  // of the root, so that the arm is not cut off
      return r + std::max(drop * std::exp(-std::pow((s - 0.035 * u) / (0.09 * u), 2)), thinnest);
    });
  };
  arm_high_ = arm_profile(&Ring::high, 0);
  arm_low_ = arm_profile(&Ring::low, tuning.arm_root);
  arm_deep_ = arm_profile(&Ring::deep, 0);

  // ---- legs: half ovals along a line that leaves the hip joint outwards ----
  if (params.legs) {
    const double r = *m.upperLeg * tuning.thigh / (2 * pi), k = *m.knee * tuning.knee / (2 * pi), a = *m.ankle * tuning.ankle / (2 * pi);
    const double apart = 0.024 * u;  // of the thigh from the plane of symmetry
    const double hip = l.seat + 0.02 * u, z = centre_.at(l.seat).f;
    const double x = apart + 0.93 * r;
    struct Ring {
      double y, x, z, wide, front, back;
    };
    const std::vector<Ring> rings = {
        {l.floor - 0.08 * u, 0.152 * u, z - 0.044 * u, 1.0 * a, 0.98 * a, 1.02 * a},
        {l.ankle, 0.150 * u, z - 0.040 * u, 0.97 * a, 1.0 * a, 1.06 * a},
        {l.ankle + 0.3 * (l.knee - l.ankle), 0.145 * u, z - 0.030 * u, 0.55 * a + 0.45 * k, 0.55 * a + 0.44 * k, 0.55 * a + 0.50 * k},
        {l.calf, 0.138 * u, z - 0.020 * u, 0.98 * k, 0.86 * k, 1.12 * k},
        {l.knee, 0.127 * u, z - 0.006 * u, 0.97 * k, 1.03 * k, 1.0 * k},
        {l.knee + 0.35 * (l.thigh - l.knee), 0.45 * 0.127 * u + 0.55 * x - 0.001 * u, z, 0.4 * r + 0.6 * k, 0.46 * r + 0.6 * k, 0.40 * r + 0.6 * k},
        {l.thigh, x, z, 0.93 * r, 1.09 * r, 1.07 * r},
        {0.4 * l.thigh + 0.6 * hip, x - 0.008 * u, z, 0.87 * r, 0.96 * r, 1.0 * r},
        {hip + 0.1 * u, x - 0.030 * u, z, 0.66 * r, 0.66 * r, 0.7 * r}};
    const auto leg_profile = [&](double Ring::*member) {
      std::vector<std::pair<double, double>> knots;
      for (const Ring& ring : rings) knots.emplace_back(ring.y, ring.*member);
      return Profile(knots, 0.03 * u);
    };
    leg_x_ = leg_profile(&Ring::x);
    leg_z_ = leg_profile(&Ring::z);
    leg_wide_ = leg_profile(&Ring::wide);
    leg_front_ = leg_profile(&Ring::front);
    leg_back_ = leg_profile(&Ring::back);
  }

  // ---- without arms: the plate that closes the armhole, from the shoulder tip to the side under the armpit ----
  const double side = width_.at(l.chest).f;
  const Vector3d plate_top(l.half_shoulder + 0.010 * u, l.shoulder, 0), plate_bottom(side + 0.012 * u, l.chest, 0);
  plate_point_ = plate_top;
  plate_normal_ = Vector3d(plate_top.y() - plate_bottom.y(), plate_bottom.x() - plate_top.x(), 0).normalized();

  // ---- muscle and bone ----
  const auto front = [&](double y) { return centre_.at(y).f + front_.at(y).f; };
  const auto back = [&](double y) { return centre_.at(y).f - back_.at(y).f; };
  const double blade = l.armpit + 0.035 * u;
  bump(0.085, blade, back(blade), 0.055, 0.075, 0.05, 0.008);                                   // shoulder blades
  bump(0, 0.55 * l.waist + 0.45 * l.armpit, back(l.waist) - 0.01 * u, 0.026, 0.16, 0.07, male ? -0.009 : -0.008);  // hollow of the spine
  bump(0.085, l.seat + 0.01 * u, back(l.seat), 0.055, 0.06, 0.05, male ? 0.010 : 0.012);         // buttocks
  bump(0, l.seat - 0.02 * u, back(l.seat), 0.016, 0.07, 0.05, -0.014);                           // between them
  bump(0, l.hips - 0.01 * u, front(l.hips), 0.09, 0.06, 0.05, male ? 0.003 : 0.005);             // belly
  if (male) {
    bump(0.085, l.chest + 0.015 * u, front(l.chest), 0.058, 0.045, 0.05, 0.011);  // chest muscles
    bump(0, l.chest + 0.01 * u, front(l.chest), 0.018, 0.07, 0.05, -0.006);       // breast bone
  } else {
    Breast b;
    b.x = m.bustSpan.value_or(0.185 * m.chest) / 2 + tuning.bust_out;
    b.y = l.bust - 0.004 * u;
    b.inner = 0.074 * u, b.outer = 0.082 * u, b.upper = 0.100 * u, b.lower = 0.064 * u;
    b.height = std::max(0.004 * u, 0.042 * u * (1 + 3 * (tuning.chest - 1)));
    breast_ = b;
  }
  // Collar bones' hollow over the shoulder front
  bump(0.075, l.hps - 0.045 * u, front(l.hps - 0.045 * u) - 0.012 * u, 0.045, 0.016, 0.04, -0.004);
}

double Shape::torso(const Vector3d& p) const {
  const double u = levels_.unit;
  const auto w = width_.at(p.y()), df = front_.at(p.y()), db = back_.at(p.y()), c = centre_.at(p.y());
  const double s = p.z() - c.f;
  const double sigma = frontness(s, 0.03 * u);
  const double n = back_power_.at(p.y()).f * (1 - sigma) + front_power_.at(p.y()).f * sigma;
  const double d = db.f + (df.f - db.f) * sigma, dd = db.d + (df.d - db.d) * sigma;
  const double A = std::abs(p.x()) / w.f, B = std::abs(s) / d;
  const double big = std::max({A, B, 1e-3});
  const double pa = A == big ? 1 : std::pow(A / big, n), pb = B == big ? 1 : std::pow(B / big, n), sum = pa + pb;
  const double g = big * std::pow(sum, 1 / n);
  // (A / g)^(n - 1) and (B / g)^(n - 1), without further powers
  const double a = A > 0 ? pa / sum * g / A : 0, b = B > 0 ? pb / sum * g / B : 0;
  const double gx = a / w.f, gz = b / d;
  const double gy = -a * A * w.d / w.f - b * B * dd / d - (s > 0 ? 1 : -1) * gz * c.d;
  return (g - 1) / std::sqrt(gx * gx + gy * gy + gz * gz + 1e-6);
}

double Shape::arm(const Vector3d& p) const {
  const double u = levels_.unit;
  const Vector3d q = p - levels_.arm_joint;
  const double t = q.dot(levels_.arm_direction);
  const double a = q.dot(levels_.arm_outer), b = q.dot(levels_.arm_direction.cross(levels_.arm_outer));
  const double sigma = frontness(a, 0.012 * u);
  const auto high = arm_high_.at(t), low = arm_low_.at(t), deep = arm_deep_.at(t);
  const double r = low.f + (high.f - low.f) * sigma, dr = low.d + (high.d - low.d) * sigma;
  const double A = a / r, B = b / deep.f, T = std::min(t, 0.0) / (0.062 * u);
  const double g = std::max(1e-3, std::sqrt(A * A + B * B + T * T));
  const double ga = A / g / r, gb = B / g / deep.f, gt = (-A * A * dr / r - B * B * deep.d / deep.f + T / (0.062 * u)) / g;
  const double tube = (g - 1) / std::sqrt(ga * ga + gb * gb + gt * gt);
  return smooth_max(tube, t - (levels_.hand + 0.012 * u), 0.02 * u);
}

// The left leg; both are the mirror images of one another, so x is not folded here: the saddle between them is smooth.
double Shape::leg(const Vector3d& p) const {
  const double u = levels_.unit;
  const auto cx = leg_x_.at(p.y()), cz = leg_z_.at(p.y()), w = leg_wide_.at(p.y()), df = leg_front_.at(p.y()), db = leg_back_.at(p.y());
  const double a = p.x() - cx.f, b = p.z() - cz.f;
  const double sigma = frontness(b, 0.012 * u);
  const double d = db.f + (df.f - db.f) * sigma, dd = db.d + (df.d - db.d) * sigma;
  const double A = a / w.f, B = b / d, top = levels_.seat + 0.02 * u, T = std::max(p.y() - top, 0.0) / (0.07 * u);
  const double g = std::max(1e-3, std::sqrt(A * A + B * B + T * T));
  const double ga = A / g / w.f, gb = B / g / d, gy = (-A * A * w.d / w.f - A / w.f * cx.d - B * B * dd / d - B / d * cz.d + T / (0.07 * u)) / g;
  const double tube = (g - 1) / std::sqrt(ga * ga + gb * gb + gy * gy + 1e-9);
  return smooth_max(tube, levels_.floor - p.y(), 0.02 * u);
}

double Shape::operator()(const Vector3d& p) const {
  const double u = levels_.unit;
  const Vector3d q(std::abs(p.x()), p.y(), p.z());
  double f;
  if (breast_) {
    // The front is drawn forward: a height field over (x, y), flatter on top than a bell, steeper below than above.
    const auto one = [&](double side) {
      const double dx = p.x() * side - breast_->x, dy = p.y() - breast_->y;
      const double wx = breast_->inner + (breast_->outer - breast_->inner) * frontness(dx, 0.02 * u);
      const double wy = breast_->lower + (breast_->upper - breast_->lower) * frontness(dy, 0.02 * u);
      const double r_sq = dx * dx / (wx * wx) + dy * dy / (wy * wy);
      return r_sq > 9 ? 0.0 : std::exp(-std::pow(r_sq, 1.25));
    };
    const double fore = frontness(p.z() - centre_.at(p.y()).f - 0.02 * u, 0.03 * u);
    f = torso({p.x(), p.y(), p.z() - breast_->height * (one(1) + one(-1)) * fore});
  } else {
    f = torso(p);
  }
  for (const Bump& b : bumps_) {
    const auto one = [&](double side) {
      const Vector3d r = (Vector3d(p.x() * side, p.y(), p.z()) - b.centre).cwiseQuotient(b.size);
      const double sq = r.squaredNorm();
      return sq > 20 ? 0.0 : std::exp(-sq);  // 2e-9 of its height: less than a nanometre
    };
    f -= b.height * (b.centre.x() > 0 ? one(1) + one(-1) : one(1));
  }
  if (params_.arms) {
    // A wide fold under the arm, a narrow one over the shoulder, where it would stand up as an epaulette.
    const double over = frontness(p.y() - levels_.arm_joint.y() - 0.01 * u, 0.025 * u);
    f = smooth_min(f, arm(q), arm_blend_ + (0.022 * u - arm_blend_) * over);
  } else {
    const double below = std::max(levels_.chest + 0.02 * u - p.y(), 0.0);  // the plate ends under the armpit
    f = smooth_max(f, (q - plate_point_).dot(plate_normal_) - below * below / (0.05 * u), 0.022 * u);
  }
  f = smooth_max(f, levels_.bottom - p.y(), (params_.legs ? 0.035 : 0.065) * u);
  if (params_.legs) {
    const double both = smooth_min(leg(p), leg({-p.x(), p.y(), p.z()}), 0.02 * u);
    f = smooth_min(f, both, 0.07 * u);
  }
  // The neck's cap leans less than its base.
  const Vector3d cap(0, std::cos(0.2), std::sin(0.2));
  const double over = (p - Vector3d(0, levels_.top, centre_.at(levels_.top).f)).dot(cap);
  return smooth_max(f, over, 0.018 * u);
}

double Shape::sizing(const Vector3d& p) const {
  const double u = levels_.unit;
  double s = 1;
  const double over = (p.y() - levels_.hps + 0.03 * u) / (0.04 * u);
  s -= 0.25 * std::clamp(over, 0.0, 1.0);
  if (params_.arms) {
    const double t = (Vector3d(std::abs(p.x()), p.y(), p.z()) - levels_.arm_joint).dot(levels_.arm_direction) / levels_.hand;
    if (p.x() > levels_.half_shoulder - 0.05 * u) s -= 0.45 * std::clamp((t - 0.05) / 0.95, 0.0, 1.0);
  }
  if (params_.arms) {
    // The hollow under the arm is narrow.
    const Vector3d pit(levels_.half_shoulder - 0.01 * u, levels_.armpit, levels_.arm_joint.z());
    const double near = (Vector3d(std::abs(p.x()), p.y(), p.z()) - pit).squaredNorm() / (0.0036 * u * u);
    s *= 1 - 0.3 * std::exp(-near);
  } else {
    const double off = (Vector3d(std::abs(p.x()), p.y(), p.z()) - plate_point_).dot(plate_normal_) / (0.03 * u);
    const double high = (p.y() - levels_.chest) / (0.03 * u);
    s *= 1 - 0.35 * std::exp(-off * off) * frontness(high, 1);
  }
  if (params_.legs) {
    // Finer down the leg, and where the thighs part.
    s -= 0.35 * std::clamp((levels_.crotch - p.y()) / (levels_.crotch - levels_.ankle), 0.0, 1.0);
    const Vector3d fork(0, levels_.crotch, centre_.at(levels_.seat).f);
    const Vector3d d = (Vector3d(std::abs(p.x()), p.y(), p.z()) - fork).cwiseQuotient(Vector3d(0.05 * u, 0.05 * u, 0.12 * u));
    s *= 1 - 0.35 * std::exp(-d.squaredNorm());
  }
  return s;
}

Vector3d Shape::low() const { return {0, (params_.legs ? levels_.floor : levels_.bottom) - 0.03 * levels_.unit, -0.26 * levels_.unit - 0.1}; }
Vector3d Shape::high() const {
  const double u = levels_.unit;
  const double out = params_.arms ? levels_.arm_joint.x() + (levels_.hand + 0.05 * u) * levels_.arm_direction.x() + 0.06 * u : 0;
  return {std::max(out, 0.45 * u), levels_.top + 0.06 * u, 0.42 * u};
}

}  // namespace toile::form
