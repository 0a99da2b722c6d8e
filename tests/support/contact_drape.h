// A crude drape: enough of a cloth (gravity, stiff edges, contacts pushed apart) to bring a sheet into the states that a
// simulator brings it into. It exercises the contact library; it is no simulator.
#pragma once

#include "contact_shapes.h"
#include "toile/contact/search.h"

namespace toile::test {

struct Drape {
  contact::Surface surface;
  mesh::Points3 x, velocity;
  mesh::Points3 support_x;
  contact::Search search;
  Eigen::VectorXd rest;  ///< lengths of edges
  double thickness = 1e-3;
  double step = 5e-3;
  int sweeps = 20;
  Eigen::Vector3d gravity{0, 0, -9.81};
  contact::LimitOptions options;
  mesh::Points3 target;  ///< where the last step wanted to go, from `x_before`
  mesh::Points3 x_before;
  contact::StepLimit last;

  Drape(const Shape& cloth, const Shape& support)
      : surface(contact::make_surface(static_cast<int>(cloth.x.rows()), cloth.faces)),
        x(cloth.x),
        velocity(mesh::Points3::Zero(cloth.x.rows(), 3)),
        support_x(support.x),
        search(surface, cloth.x, contact::make_surface(static_cast<int>(support.x.rows()), support.faces), support.x),
        rest(static_cast<Eigen::Index>(surface.edges.size())) {
    for (Eigen::Index e = 0; e < rest.size(); ++e) rest[e] = (x.row(surface.edges[e][0]) - x.row(surface.edges[e][1])).norm();
  }

  /// The positions that the next step aims at.
  void aim() {
    target = x + step * velocity;
    target.rowwise() += (step * step * gravity).transpose();
    const contact::Contacts contacts = search.proximity(x, support_x, {2 * thickness, 2 * thickness});
    for (int sweep = 0; sweep < sweeps; ++sweep) {
      for (Eigen::Index e = 0; e < rest.size(); ++e) {
        const auto [a, b] = surface.edges[e];
        const Eigen::RowVector3d d = target.row(b) - target.row(a);
        const double length = d.norm();
        if (!(length > 0)) continue;
        const Eigen::RowVector3d move = 0.5 * (1 - rest[e] / length) * d;
        target.row(a) += move;
        target.row(b) -= move;
      }
      if (sweep % 4 == 3 || sweep == sweeps - 1) {
        push(contacts.self);
        push(contacts.support);
      }
    }
  }

  void push(std::span<const contact::Contact> list) {
    for (const contact::Contact& c : list) {
      Eigen::RowVector3d before = Eigen::RowVector3d::Zero(), gap = before;
      double inverse = 0;
      std::array<bool, 4> fixed;
      for (int k = 0; k < 4; ++k) {
        fixed[k] = (c.kind == contact::Kind::vertex_support_face && k > 0) || (c.kind == contact::Kind::support_vertex_face && k == 0) ||
                   (c.kind == contact::Kind::edge_support_edge && k > 1);
        gap += c.weight[k] * (fixed[k] ? support_x : target).row(c.node[k]);
        before += c.weight[k] * (fixed[k] ? support_x : x).row(c.node[k]);
        if (!fixed[k]) inverse += c.weight[k] * c.weight[k];
      }
      const Eigen::RowVector3d n = before / c.distance;
      const double lack = thickness - gap.dot(n);
      if (!(lack > 0) || !(inverse > 0)) continue;
      for (int k = 0; k < 4; ++k) {
        // The push, and friction that takes half of the sliding.
        if (!fixed[k]) target.row(c.node[k]) += c.weight[k] / inverse * (lack * n - 0.5 * (gap - before - (gap - before).dot(n) * n));
      }
    }
  }

  void advance() {
    aim();
    x_before = x;
    last = search.limit_step(x, target, support_x, support_x, options);
    velocity = 0.98 / step * (last.x - x);
    x = last.x;
  }
};

}  // namespace toile::test
