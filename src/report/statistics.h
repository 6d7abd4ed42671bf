// SPDX-License-Identifier: Apache-2.0
// report: statistics of small samples: quartiles and box plots, percentile ranks, CUSUM, the exact Mann-Whitney test.
#pragma once
#include <cstddef>
#include <vector>

namespace catgut {

// Linear between order statistics (type 7 of Hyndman and Fan 1996, 10.2307/2684934). NaN for an empty sample.
double quantile(std::vector<double> values, double p);

// Tukey's box plot: whiskers at the last values within 1.5 interquartile ranges of the box.
struct Box {
  size_t n = 0;
  double low = 0, q1 = 0, median = 0, q3 = 0, high = 0, mean = 0;
  std::vector<double> outliers;
};
Box box_of(std::vector<double> values);

// [%] of the sample below x, equal values counted half. NaN for an empty sample.
double percentile_rank(const std::vector<double>& values, double x);

// Cumulative sum of failures against an acceptable rate p0 and an unacceptable rate p1 (Bolsin and Colson 2000,
// 10.1093/intqhc/12.5.433). A success subtracts s, a failure adds 1 - s. Below -h0: the failure rate is
// acceptable; above h1: it is not. alpha, beta: probabilities of the two wrong conclusions.
struct Cusum {
  double p0 = 0.05, p1 = 0.15, alpha = 0.1, beta = 0.1;
  double s = 0, h0 = 0, h1 = 0;
  std::vector<double> line;  // after each attempt
};
Cusum cusum(const std::vector<bool>& success, double p0 = 0.05, double p1 = 0.15, double alpha = 0.1, double beta = 0.1);

// Two-sided probability that two samples of one distribution differ in rank sum by at least as many ranks as these do.
// Exact, with ties (mean ranks), by counting the rank sums of all divisions (Mann and Whitney 1947, 10.1214/aoms/1177730491).
// At most kMostExact values in all; NaN beyond, or when a sample is empty.
constexpr size_t kMostExact = 200;
double mann_whitney(const std::vector<double>& a, const std::vector<double>& b);

}  // namespace catgut
