// SPDX-License-Identifier: Apache-2.0
// wall/factor: see the header.
#include "wall/factor.h"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCholesky>
#include <algorithm>

#include "core/check.h"

namespace catgut::wall {

namespace {

using Sparse = Eigen::SparseMatrix<double>;

// Post-order of the elimination tree of `a` (lower triangle, already permuted).
std::vector<int> post_order(const Sparse& a) {
  const int n = static_cast<int>(a.cols());
  std::vector<int> parent(n, -1), ancestor(n, -1);
  const Sparse upper = a.transpose();
  for (int j = 0; j < n; ++j)
    for (Sparse::InnerIterator it(upper, j); it; ++it) {
      int i = static_cast<int>(it.row());
      while (i != -1 && i < j) {
        const int next = ancestor[i];
        ancestor[i] = j;
        if (next == -1) parent[i] = j;
        i = next;
      }
    }
  std::vector<std::vector<int>> child(n + 1);
  for (int j = 0; j < n; ++j) child[parent[j] == -1 ? n : parent[j]].push_back(j);
  std::vector<int> order, stack{n};
  std::vector<size_t> next(n + 1, 0);
  while (!stack.empty()) {
    const int at = stack.back();
    if (next[at] < child[at].size()) stack.push_back(child[at][next[at]++]);
    else {
      if (at != n) order.push_back(at);
      stack.pop_back();
    }
  }
  return order;
}

template <uint32_t W>
void forward(const Panel& p, const uint32_t* row, const float* value, Float4* x) {
  Lanes b[W], s[W];
  for (uint32_t i = 0; i < W; ++i) b[i] = load(x[p.first + i]);
  for (uint32_t i = 0; i < W; ++i) {
    s[i] = splat(value[4 * i]) * b[0];
    for (uint32_t j = 1; j <= i; ++j) s[i] = s[i] + splat(value[4 * i + j]) * b[j];
  }
  for (uint32_t i = 0; i < W; ++i) store(x[p.first + i], s[i]);
  value += 16;
  for (uint32_t k = 0; k < p.count; ++k, value += W) {
    Float4& at = x[row[k]];
    Lanes sum = splat(value[0]) * s[0];
    for (uint32_t i = 1; i < W; ++i) sum = sum + splat(value[i]) * s[i];
    store(at, load(at) - sum);
  }
}

template <uint32_t W>
void backward(const Panel& p, const uint32_t* row, const float* value, Float4* x) {
  Lanes even[W], odd[W];
  for (uint32_t i = 0; i < W; ++i) even[i] = load(x[p.first + i]), odd[i] = splat(0);
  const float* v = value + 16;
  uint32_t k = 0;
  for (; k + 1 < p.count; k += 2, v += 2 * W) {
    const Lanes a = load(x[row[k]]), b = load(x[row[k + 1]]);
    for (uint32_t i = 0; i < W; ++i) even[i] = even[i] - splat(v[i]) * a, odd[i] = odd[i] - splat(v[W + i]) * b;
  }
  if (k < p.count) {
    const Lanes a = load(x[row[k]]);
    for (uint32_t i = 0; i < W; ++i) even[i] = even[i] - splat(v[i]) * a;
  }
  for (uint32_t i = 0; i < W; ++i) even[i] = even[i] + odd[i];
  for (uint32_t j = 0; j < W; ++j) {
    Lanes s = splat(value[4 * j + j]) * even[j];
    for (uint32_t i = j + 1; i < W; ++i) s = s + splat(value[4 * i + j]) * even[i];
    store(x[p.first + j], s);
  }
}

}  // namespace

Factor factorize(uint32_t size, std::span<const Entry> entry) {
  const int n = static_cast<int>(size);
  std::vector<Eigen::Triplet<double>> triplet;
  const auto assemble = [&](const std::vector<int>& place) {
    triplet.clear();
    for (const Entry& e : entry) {
      const int r = place[e.row], c = place[e.column];
      triplet.emplace_back(std::max(r, c), std::min(r, c), e.value);
    }
    Sparse m(n, n);
    m.setFromTriplets(triplet.begin(), triplet.end());
    return m;
  };
  std::vector<int> place(size);
  for (int i = 0; i < n; ++i) place[i] = i;
  Sparse a = assemble(place);
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> order;
  Eigen::AMDOrdering<int> amd;
  amd(a.selfadjointView<Eigen::Lower>(), order);  // order.indices()[k]: the row that comes k-th
  for (int k = 0; k < n; ++k) place[order.indices()[k]] = k;
  a = assemble(place);
  const std::vector<int> post = post_order(a);
  std::vector<int> later(size);
  for (int k = 0; k < n; ++k) later[post[k]] = k;
  for (int& p : place) p = later[p];
  a = assemble(place);

  Eigen::SimplicialLLT<Sparse, Eigen::Lower, Eigen::NaturalOrdering<int>> llt(a);
  CATGUT_CHECK(llt.info() == Eigen::Success);
  const Sparse l = llt.matrixL();

  Factor f;
  f.size = size;
  f.place.assign(place.begin(), place.end());
  std::vector<std::vector<uint32_t>> below(size);
  for (int j = 0; j < n; ++j)
    for (Sparse::InnerIterator it(l, j); it; ++it)
      if (it.row() > j) below[j].push_back(static_cast<uint32_t>(it.row()));
  for (uint32_t j = 0; j < size;) {
    // A panel takes the next column while that adds few explicit zeros.
    uint32_t width = 1;
    std::vector<uint32_t> pattern = below[j];
    size_t zeros = 0;
    while (width < 4 && j + width < size && !pattern.empty() && pattern.front() == j + width) {
      std::vector<uint32_t> rest(pattern.begin() + 1, pattern.end()), both;
      const std::vector<uint32_t>& next = below[j + width];
      std::set_union(rest.begin(), rest.end(), next.begin(), next.end(), std::back_inserter(both));
      const size_t more = (both.size() - rest.size()) * width + (both.size() - next.size());
      if (zeros + more > 2 + both.size() * (width + 1) / 5) break;
      zeros += more, pattern = both, ++width;
    }
    Panel p;
    p.first = j, p.width = width;
    p.index = static_cast<uint32_t>(f.row.size()), p.count = static_cast<uint32_t>(pattern.size());
    p.value = static_cast<uint32_t>(f.value.size());
    Eigen::MatrixXd corner = Eigen::MatrixXd::Zero(width, width);
    for (uint32_t i = 0; i < width; ++i)
      for (uint32_t k = 0; k <= i; ++k) corner(i, k) = l.coeff(static_cast<int>(j + i), static_cast<int>(j + k));
    const Eigen::MatrixXd inverse = corner.triangularView<Eigen::Lower>().solve(Eigen::MatrixXd::Identity(width, width));
    for (uint32_t i = 0; i < 4; ++i)
      for (uint32_t k = 0; k < 4; ++k) f.value.push_back(i < width && k <= i ? static_cast<float>(inverse(i, k)) : 0.0f);
    for (uint32_t r : pattern) {
      f.row.push_back(r);
      for (uint32_t i = 0; i < width; ++i)
        f.value.push_back(static_cast<float>(l.coeff(static_cast<int>(r), static_cast<int>(j + i))));
    }
    f.panel.push_back(p);
    j += width;
  }
  return f;
}

void solve(const Factor& f, Float4* x) {
  for (const Panel& p : f.panel) {
    const uint32_t* row = f.row.data() + p.index;
    const float* value = f.value.data() + p.value;
    switch (p.width) {
      case 1:
        forward<1>(p, row, value, x);
        break;
      case 2:
        forward<2>(p, row, value, x);
        break;
      case 3:
        forward<3>(p, row, value, x);
        break;
      default:
        forward<4>(p, row, value, x);
    }
  }
  for (size_t k = f.panel.size(); k-- > 0;) {
    const Panel& p = f.panel[k];
    const uint32_t* row = f.row.data() + p.index;
    const float* value = f.value.data() + p.value;
    switch (p.width) {
      case 1:
        backward<1>(p, row, value, x);
        break;
      case 2:
        backward<2>(p, row, value, x);
        break;
      case 3:
        backward<3>(p, row, value, x);
        break;
      default:
        backward<4>(p, row, value, x);
    }
  }
}

}  // namespace catgut::wall
