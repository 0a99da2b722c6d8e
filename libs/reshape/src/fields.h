// Smooth fields on a surface between what is given and what stays.
#pragma once

#include "toile/reshape/surface.h"

#include <Eigen/SparseCore>
#include <vector>

namespace toile::reshape {

/// Cotangent Laplacian (positive semi-definite, |V| x |V|) and lumped masses [m2] of a triangle surface.
struct Operators {
  Eigen::SparseMatrix<double> laplacian;
  Eigen::VectorXd mass;
};
Operators operators(const Points3& x, const Triangles& faces);

enum class State : char { stays, free, given };

/// The field that is `value` where given, zero where it stays, and between them has the least integral of its squared
/// Laplacian: it and its slope go over continuously.
/// Precondition: every connected set of free vertices touches a given one or one that stays.
Points3 biharmonic_field(const Operators& op, const std::vector<State>& state, const Points3& value);

/// Distance over mesh edges from the vertices of `seeds` [m], infinite where none leads; vertices with open[v] == 0 are not
/// passed through.
std::vector<double> edge_distances(const Points3& x, const Triangles& faces, const std::vector<int>& seeds, const std::vector<char>& open);

/// Vertices joined by an edge, increasing.
std::vector<std::vector<int>> neighbours(Eigen::Index vertices, const Triangles& faces);

}  // namespace toile::reshape
