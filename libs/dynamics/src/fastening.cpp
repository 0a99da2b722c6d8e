#include "toile/dynamics/fastening.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace toile::dynamics {
namespace {

constexpr double closing_move = 5e-3;      // a limited pull leads a half so far in a step: the softer its spring, the farther [m]
constexpr double default_stiffness = 500;  // of the spring of an exact pair: its error a step is the change of force over this [N/m]

}  // namespace

Fastening::Fastening(const mesh::GarmentMesh& garment, const Points3& x, const FasteningOptions& options) : options_(options) {
  for (const mesh::Fastener& f : garment.fasteners) {
    Pair pair;
    pair.gap = pair.nearest = (x.row(f.a) - x.row(f.b)).norm();
    pair.length = std::max(f.length, options.thickness);
    pair.exact = !(f.stiffness > 0);
    pair.stiffness = pair.exact ? default_stiffness : f.stiffness;
    pair.target = pair.gap;
    pair.shrink = std::max(pair.gap - pair.length, 0.0) / options.steps;
    if (f.closed) pair.phase = f.capture > 0 && pair.gap > f.capture ? Phase::waiting : Phase::closing;
    set_rest(pair);
    pairs_.push_back(pair);
    vertex_.push_back({f.a, f.b});
    capture_.push_back(f.capture);
  }
}

void Fastening::set_rest(Pair& pair) const {
  pair.spring = pair.stiffness;
  switch (pair.phase) {
    case Phase::open:
    case Phase::waiting:
      pair.spring = 0;
      pair.rest = pair.gap;
      break;
    case Phase::closing:
    case Phase::given_up:
      pair.spring = std::min(pair.stiffness, options_.pull / closing_move);
      pair.rest = std::max(pair.target - pair.force / pair.spring, pair.gap - options_.pull / pair.spring);
      break;
    case Phase::closed:
      pair.rest = pair.exact ? pair.length - pair.force / pair.stiffness : pair.length;
      break;
  }
}

bool Fastening::advance(const Points3& x) {
  bool changed = false;
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    Pair& pair = pairs_[i];
    const double rest_before = pair.rest;
    const Phase phase_before = pair.phase;
    pair.gap = (x.row(vertex_[i][0]) - x.row(vertex_[i][1])).norm();
    if (pair.phase == Phase::waiting && pair.gap <= capture_[i]) {
      pair.phase = Phase::closing;
      pair.target = pair.nearest = pair.gap;
      pair.shrink = std::max(pair.gap - pair.length, 0.0) / options_.steps;
    }
    if (pair.phase == Phase::closing || pair.phase == Phase::given_up) {
      const double force = pair.spring * std::max(pair.gap - pair.rest, 0.0);
      pair.target = std::max(pair.target - pair.shrink, pair.length);
      if (pair.gap <= pair.length + options_.near) {
        pair.phase = Phase::closed;
        pair.force = force;
      } else {
        // At the end of its way the target stays, and the force grows up to the limit.
        if (!(pair.target > pair.length)) pair.force = std::clamp(pair.force + 0.5 * pair.spring * (pair.gap - pair.length), 0.0, options_.pull);
        if (pair.force < options_.pull || pair.gap < pair.nearest - options_.tolerance) {
          pair.nearest = pair.gap;
          pair.tried = 0;
        } else if (++pair.tried > options_.patience) {
          pair.phase = Phase::given_up;
        }
      }
    } else if (pair.phase == Phase::closed && pair.exact && std::abs(pair.gap - pair.length) > 0.2 * options_.tolerance) {
      pair.force = std::max(0.0, pair.force + pair.stiffness * (pair.gap - pair.length));
    }
    set_rest(pair);
    const bool pulls = pair.phase != Phase::open && pair.phase != Phase::waiting;
    changed = changed || (pulls && pair.rest != rest_before) || pair.phase != phase_before;
  }
  return changed;
}

void Fastening::hold() {
  for (Pair& pair : pairs_) {
    pair.force = 0;
    if (pair.phase == Phase::closing || pair.phase == Phase::given_up) pair.phase = Phase::closed;
    set_rest(pair);
  }
}

void Fastening::apply(mechanics::Sheet& sheet) const {
  for (mechanics::Spring& spring : sheet.springs) {
    if (spring.fastener < 0) continue;
    const Pair& pair = pairs_[static_cast<std::size_t>(spring.fastener)];
    spring.length = pair.rest;
    spring.stiffness = pair.spring;
  }
}

void Fastening::apply(mechanics::ParticleModel& model) const {
  for (std::size_t i = 0; i < model.fastener_spring.size(); ++i) {
    if (model.fastener_spring[i] < 0) continue;
    const auto s = static_cast<std::size_t>(model.fastener_spring[i]);
    model.springs.length[s] = pairs_[i].rest;
    model.springs.stiffness[s] = pairs_[i].spring;
  }
}

bool Fastening::settled() const {
  return std::all_of(pairs_.begin(), pairs_.end(), [&](const Pair& pair) {
    if (pair.phase == Phase::closing) return false;
    return pair.phase != Phase::closed || !pair.exact || pair.gap <= pair.length + options_.tolerance;
  });
}

std::vector<ClosureState> Fastening::states(const mesh::GarmentMesh& garment, const Points3& x) const {
  Points3 normal = Points3::Zero(garment.vertex_count(), 3);
  for (Eigen::Index f = 0; f < garment.face_count(); ++f) {
    const Eigen::RowVector3d p = x.row(garment.faces(f, 0)), q = x.row(garment.faces(f, 1)), r = x.row(garment.faces(f, 2));
    const Eigen::RowVector3d n = (q - p).cross(r - p);
    for (int k = 0; k < 3; ++k) normal.row(garment.faces(f, k)) += n;
  }
  std::vector<ClosureState> result(garment.closures.size());
  for (std::size_t i = 0; i < result.size(); ++i) {
    result[i].name = garment.closures[i].name;
    result[i].kind = garment.closures[i].kind;
  }
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    const Pair& pair = pairs_[i];
    const mesh::Fastener& fastener = garment.fasteners[i];
    if (pair.phase == Phase::open || fastener.closure < 0) continue;
    ClosureState& state = result[static_cast<std::size_t>(fastener.closure)];
    const Eigen::RowVector3d across = x.row(fastener.b) - x.row(fastener.a);
    const double gap = across.norm();
    if (state.halves++ == 0 || gap - pair.length > state.gap - state.length) {
      state.gap = gap;
      state.length = pair.length;
    }
    // At rest is what counts: a pair that has been drawn apart again is not closed.
    const bool closed = pair.phase == Phase::closed && gap <= pair.length + 2 * options_.near;
    if (!closed) continue;
    ++state.closed;
    state.force = std::max(state.force, pair.spring * std::max(gap - pair.rest, 0.0));
    if (fastener.kind != mesh::Fastener::Kind::button) continue;
    const double over = across.dot(normal.row(fastener.a).normalized()), under = across.dot(normal.row(fastener.b).normalized());
    if (over + under < -0.6 * gap) ++state.turned;
  }
  return result;
}

}  // namespace toile::dynamics
