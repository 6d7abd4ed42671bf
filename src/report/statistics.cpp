// SPDX-License-Identifier: Apache-2.0
// report: statistics; see the header for definitions and sources.
#include "report/statistics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace catgut {

double quantile(std::vector<double> values, double p) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::sort(values.begin(), values.end());
  const double at = p * static_cast<double>(values.size() - 1);
  const size_t below = static_cast<size_t>(at), above = std::min(below + 1, values.size() - 1);
  return values[below] + (at - static_cast<double>(below)) * (values[above] - values[below]);
}

Box box_of(std::vector<double> values) {
  Box box;
  box.n = values.size();
  if (values.empty()) return box;
  std::sort(values.begin(), values.end());
  box.q1 = quantile(values, 0.25), box.median = quantile(values, 0.5), box.q3 = quantile(values, 0.75);
  box.mean = std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
  const double reach = 1.5 * (box.q3 - box.q1);
  box.low = box.q1, box.high = box.q3;
  for (double v : values) {
    if (v < box.q1 - reach || v > box.q3 + reach) {
      box.outliers.push_back(v);
    } else {
      box.low = std::min(box.low, v);
      box.high = std::max(box.high, v);
    }
  }
  return box;
}

double percentile_rank(const std::vector<double>& values, double x) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  double below = 0;
  for (double v : values) below += v < x ? 1 : v == x ? 0.5 : 0;
  return 100 * below / static_cast<double>(values.size());
}

Cusum cusum(const std::vector<bool>& success, double p0, double p1, double alpha, double beta) {
  Cusum c;
  c.p0 = p0, c.p1 = p1, c.alpha = alpha, c.beta = beta;
  const double p = std::log(p1 / p0), q = std::log((1 - p0) / (1 - p1));
  c.s = q / (p + q);
  c.h0 = std::log((1 - alpha) / beta) / (p + q);
  c.h1 = std::log((1 - beta) / alpha) / (p + q);
  double sum = 0;
  for (bool good : success) c.line.push_back(sum += good ? -c.s : 1 - c.s);
  return c;
}

double mann_whitney(const std::vector<double>& a, const std::vector<double>& b) {
  const size_t n = a.size() + b.size();
  if (a.empty() || b.empty() || n > kMostExact) return std::numeric_limits<double>::quiet_NaN();
  std::vector<double> all(a);
  all.insert(all.end(), b.begin(), b.end());
  // Twice the mean rank, a whole number.
  const auto doubled_rank = [&](double v) {
    size_t below = 0, equal = 0;
    for (double o : all) below += o < v, equal += o == v;
    return 2 * below + equal + 1;
  };
  size_t sum = 0, total = 0;
  std::vector<size_t> rank;
  for (double v : all) rank.push_back(doubled_rank(v));
  for (size_t i = 0; i < n; ++i) total += rank[i], sum += i < a.size() ? rank[i] : 0;
  // ways[k][s]: divisions with k values in the first group and a doubled rank sum s, as a share of all of the same k.
  std::vector<std::vector<double>> ways(a.size() + 1, std::vector<double>(total + 1, 0));
  ways[0][0] = 1;
  for (size_t r : rank)
    for (size_t k = a.size(); k > 0; --k)
      for (size_t s = total; s >= r; --s) ways[k][s] += ways[k - 1][s - r];
  const double expected = static_cast<double>(total) * static_cast<double>(a.size()) / static_cast<double>(n);
  const double distance = std::abs(static_cast<double>(sum) - expected);
  double extreme = 0, every = 0;
  for (size_t s = 0; s <= total; ++s) {
    every += ways[a.size()][s];
    if (std::abs(static_cast<double>(s) - expected) >= distance - 1e-9) extreme += ways[a.size()][s];
  }
  return extreme / every;
}

}  // namespace catgut
