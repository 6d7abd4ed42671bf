// SPDX-License-Identifier: Apache-2.0
// app: `catgut bench haptics`: the comparison of rendering methods, transparency and, with --out, Z-width and what a bite and
// a knot feel like.
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>

#include "commands/commands.h"
#include "core/check.h"
#include "haptic/study.h"
#include "haptic/z_width.h"
#include "procedure/scene_file.h"
#include "render/plot.h"
#include "runtime/force_curves.h"
#include "runtime/haptics.h"
#include "suture/forces.h"

namespace catgut {
namespace {

constexpr Color kOurs{30, 90, 170, 255}, kTheirs{200, 70, 50, 255}, kBandEntry{214, 232, 214, 255},
    kBandShaft{226, 222, 240, 255};
constexpr int kWide = 760, kHigh = 430;

// Force in newtons over millimeters, both from zero.
Plot force_plot(const std::string& title, const std::string& x_name, const std::vector<FeltPoint>& felt) {
  Plot plot;
  plot.title = title, plot.x_name = x_name, plot.y_name = "N";
  plot.y_axis = PlotAxis::linear;
  PlotCurve ours{"ours", kOurs, {}, true, false}, theirs{"the paper's spring, 1100 N/m", kTheirs, {}, true, false};
  for (const FeltPoint& p : felt) ours.point.push_back({p.mm, p.ours}), theirs.point.push_back({p.mm, p.paper});
  plot.curve = {theirs, ours};
  return plot;
}

// The purse-string's bite runs along the wall and exits again; the stay suture's is full thickness, and has the knot.
void write_felt(const std::string& folder, const std::string& scene) {
  prepare_output(folder + "/forces.png");
  FeltCurves c = feel_a_stitch(read_scene(scene), false, stop_on_interrupt());
  c.knot = feel_a_stitch(read_scene("stay"), true, stop_on_interrupt()).knot;
  if (c.bite.empty()) throw InputError("bench haptics", "the scripted surgeon made no bite in " + scene, "try another --scene");
  std::string csv = "what,mm,ours_N,paper_N\n";
  double entry = 0, theirs = 0;
  const auto add = [&](const char* what, const std::vector<FeltPoint>& curve) {
    char row[96];
    for (const FeltPoint& p : curve)
      std::snprintf(row, sizeof row, "%s,%.3f,%.4f,%.4f\n", what, p.mm, p.ours, p.paper), csv += row;
  };
  add("bite", c.bite), add("knot", c.knot);
  for (const FeltPoint& p : c.bite)
    if (p.mm < 4) entry = std::max(entry, p.ours), theirs = std::max(theirs, p.paper);
  write_output(folder + "/forces.csv", csv);
  const double exit = c.exit_mm > 0 ? c.exit_mm : 8;
  Plot bite = force_plot("Full bite: force on the hand over the path of the tip since entry", "tip [mm]", c.bite);
  bite.x_most = std::min(25.0, std::max(10.0, c.bite.back().mm));
  bite.y_most = 3.5;
  bite.band = {{"entry peak 0.9 +- 0.3 N (starting value; skin with these needles 0.5 to 1.0 N, Maloney et al. 2025)",
                kBandEntry,
                1.5,
                3.5,
                {0.6, 0.6},
                {1.2, 1.2}},
               {"cutting 0.15 to 0.3 N and shaft 0.03 to 0.06 N/mm while the tip is in (assumption)",
                kBandShaft,
                3.5,
                exit,
                {0.15 + 0.03 * 3.5, 0.15 + 0.03 * exit},
                {0.3 + 0.06 * 3.5, 0.3 + 0.06 * exit}}};
  double far = 10, most = 0;
  for (const FeltPoint& p : c.knot) far = std::max(far, p.mm), most = std::max(most, p.ours);
  Plot knot = force_plot("Tightening the first throw: force on the pulling hand",
                         "path of the hand since the throw started [mm]", c.knot);
  knot.x_most = far;
  knot.y_most = 4;
  knot.band = {
      {"tying by hand 1.6 N (superficial) to 3.8 N (deep), means (Laufer 2016)", kBandEntry, 0, far, {1.6, 1.6}, {3.8, 3.8}}};
  Image both = make_image(kWide, 2 * kHigh, {});
  paste(both, draw_plot(bite, kWide, kHigh), 0, 0);
  paste(both, draw_plot(knot, kWide, kHigh), 0, kHigh);
  write_png(both, folder + "/forces.png");
  std::printf(
      "\nbite: entry peak %.2f N (0.9 +- 0.3), the paper's spring %.2f N; tip out after %.1f mm\nthrow: %.2f N at most\n",
      entry, theirs, c.exit_mm, most);
  std::printf("%s/forces.png\n%s/forces.csv\n", folder.c_str(), folder.c_str());
}

constexpr std::array<Color, 3> kMethod{Color{200, 70, 50, 255}, Color{90, 150, 90, 255}, Color{30, 90, 170, 255}};

// A panel for each rate of the physics and delay to the motors; in it the boundary of passive walls for each method.
void write_z_width(const std::string& folder) {
  constexpr std::array<float, 3> kRates{60, 240, 960};
  constexpr std::array<float, 4> kDelays{0, 0.001f, 0.002f, 0.004f};
  constexpr std::array<float, 9> kDampings{0, 0.5f, 1, 1.5f, 2, 3, 4, 6, 8};
  constexpr std::array<WallMethod, 3> kMethods{WallMethod::coupling, WallMethod::patch, WallMethod::chain};
  constexpr float kStep = 50, kMost = 2000;
  constexpr int kPanelWide = 430, kPanelHigh = 320;
  Image all = make_image(kPanelWide * static_cast<int>(kDelays.size()), kPanelHigh * static_cast<int>(kRates.size()), {});
  std::string csv = "rate_Hz,delay_ms,method,damping_Ns_m,largest_passive_stiffness_N_m\n";
  std::printf("\nZ-width: largest stiffness [N/m] up to %.0f below which every wall is passive under every hand\n",
              double{kMost});
  std::printf("%-8s %-6s %-18s damping", "physics", "delay", "");
  for (const float b : kDampings) std::printf(" %5.1f", double{b});
  std::printf(" N s/m\n");
  for (size_t row = 0; row < kRates.size(); ++row)
    for (size_t column = 0; column < kDelays.size(); ++column) {
      Plot plot;
      char text[96];
      std::snprintf(text, sizeof text, "physics %.0f Hz, motors %.0f ms late", double{kRates[row]},
                    1e3 * double{kDelays[column]});
      plot.title = text, plot.x_name = "damping [N s/m]", plot.y_name = "N/m";
      plot.y_axis = PlotAxis::linear;
      plot.x_most = 8, plot.y_most = 1.05 * double{kMost};
      plot.level = {{"a Touch: 400", 400}};
      for (size_t m = 0; m < kMethods.size(); ++m) {
        if (stop_on_interrupt().load()) return;
        PlotCurve curve{wall_method_name(kMethods[m]), kMethod[m], {}, true, true};
        std::printf("%4.0f Hz  %.0f ms   %-18s        ", double{kRates[row]}, 1e3 * double{kDelays[column]},
                    curve.name.c_str());
        for (const float b : kDampings) {
          WallCase c;
          c.method = kMethods[m], c.rate = kRates[row], c.delay = kDelays[column], c.damping = b;
          const double k = double{z_width(c, kStep, kMost)};
          curve.point.push_back({double{b}, k});
          std::snprintf(text, sizeof text, "%.0f,%.0f,%s,%.1f,%.0f\n", double{c.rate}, 1e3 * double{c.delay},
                        curve.name.c_str(), double{b}, k);
          csv += text;
          std::printf(" %5.0f", k), std::fflush(stdout);
        }
        std::printf("\n");
        plot.curve.push_back(curve);
      }
      paste(all, draw_plot(plot, kPanelWide, kPanelHigh), static_cast<int>(column) * kPanelWide,
            static_cast<int>(row) * kPanelHigh);
    }
  write_png(all, folder + "/z_width.png");
  write_output(folder + "/z_width.csv", csv);
  std::printf("%s/z_width.png\n%s/z_width.csv\n", folder.c_str(), folder.c_str());
}

// Rendered impedance over that of the environment, 0.5 to 30 Hz. folder: empty: the table alone.
void write_transparency(const std::string& folder) {
  const std::vector<float> hz{0.5f, 1, 2, 3, 4, 6, 8, 10, 12, 15, 20, 25, 30};
  std::string csv = "environment,rate_Hz,frequency_Hz,gain,phase_degrees,rms_error_N,rms_force_N\n";
  std::printf(
      "\ntransparency: rendered impedance over the environment's (1: perfect), a hand moving by 1 mm, motors 2 ms late\n");
  std::printf("%-8s %-8s", "", "physics");
  for (const float f : hz) std::printf(" %5.1f", double{f});
  std::printf(" Hz\n");
  Plot gain, error;
  gain.title = "Transparency: rendered impedance over the environment's; hand +- 1 mm, motors 2 ms late, physics 60 Hz";
  gain.y_name = "gain", gain.level = {{"perfect", 1}}, gain.y_most = 1.5;
  error.title = "Error of the force at the same instant, RMS";
  error.y_name = "N", error.y_most = 0.2;
  for (Plot* p : {&gain, &error}) p->x_name = "Hz", p->y_axis = PlotAxis::linear, p->x_most = 30;
  for (const Environment e : {Environment::wall, Environment::needle, Environment::thread})
    for (const float rate : {60.0f, 960.0f}) {
      SweepCase c;
      c.environment = e, c.rate = rate;
      const std::vector<SweepPoint> points = sweep(c, hz);
      const Color color = kMethod[static_cast<size_t>(e)];
      PlotCurve g{environment_name(e), color, {}, true, true}, n = g;
      std::printf("%-8s %4.0f Hz ", environment_name(e), double{rate});
      char row[160];
      for (const SweepPoint& p : points) {
        std::printf(" %5.2f", double{p.gain});
        std::snprintf(row, sizeof row, "%s,%.0f,%.1f,%.4f,%.1f,%.4f,%.4f\n", environment_name(e), double{rate}, double{p.hz},
                      double{p.gain}, double{p.phase} * 180 / double{kPi}, double{p.rms_error}, double{p.rms});
        csv += row;
        g.point.push_back({double{p.hz}, double{p.gain}}), n.point.push_back({double{p.hz}, double{p.rms_error}});
      }
      std::printf("\n");
      if (rate < 100) gain.curve.push_back(g), error.curve.push_back(n);
    }
  if (folder.empty()) return;
  Image both = make_image(kWide, 2 * kHigh, {});
  paste(both, draw_plot(gain, kWide, kHigh), 0, 0);
  paste(both, draw_plot(error, kWide, kHigh), 0, kHigh);
  write_png(both, folder + "/transparency.png");
  write_output(folder + "/transparency.csv", csv);
  std::printf("%s/transparency.png\n%s/transparency.csv\n", folder.c_str(), folder.c_str());
}

}  // namespace

int plot_haptics_log(const std::string& file) {
  std::ifstream in(file);
  std::string line;
  if (!in || !std::getline(in, line) || line != kHapticsLogHead)
    throw InputError("--log " + file, "not a haptics log",
                     "write one with catgut play SCENE --haptics DRIVER --haptics-log FILE");
  // Three force magnitudes per millisecond; a pixel shows the maximum over its interval.
  constexpr size_t kColumns = 36;
  struct Row {
    double t;
    std::array<double, 3> force;
    bool fault;
  };
  std::array<std::vector<Row>, 2> row;
  size_t number = 1, faults = 0;
  while (std::getline(in, line)) {
    ++number;
    std::array<double, kColumns> v{};
    const char* at = line.c_str();
    size_t k = 0;
    for (; k < kColumns; ++k) {
      char* end = nullptr;
      v[k] = std::strtod(at, &end);
      if (end == at) break;
      at = *end == ',' ? end + 1 : end;
    }
    if (k < kColumns && in.peek() == EOF) break;  // the program ended within a line
    if (k < kColumns || (v[1] != 0 && v[1] != 1))
      throw InputError("--log " + file, "line " + std::to_string(number) + " cannot be read", "was the file changed?");
    Row r{v[0], {}, v[24] != 0};
    for (size_t f = 0; f < 3; ++f) r.force[f] = std::hypot(v[15 + 3 * f], v[16 + 3 * f], v[17 + 3 * f]);
    faults += r.fault;
    row[static_cast<size_t>(v[1])].push_back(r);
  }
  Image both = make_image(kWide, 2 * kHigh, {});
  for (size_t k = 0; k < 2; ++k) {
    Plot plot;
    plot.title = std::string(k == 0 ? "right" : "left") +
                 " arm: wanted by the physics' patch, allowed by the limits, written to the motors";
    plot.x_name = "s", plot.y_name = "N", plot.y_axis = PlotAxis::linear;
    PlotCurve curve[3] = {{"wanted", kTheirs, {}, true, false},
                          {"allowed", {90, 150, 90, 255}, {}, true, false},
                          {"written", kOurs, {}, true, false}};
    PlotCurve fault{"a fault", {0, 0, 0, 255}, {}, false, true};
    const size_t every = std::max<size_t>(1, row[k].size() / 1400);
    float step = 0, peak = 0;
    for (size_t i = 0; i < row[k].size(); ++i) {
      const Row& r = row[k][i];
      const double t = r.t - row[k].front().t;
      if (r.fault && (i == 0 || !row[k][i - 1].fault)) fault.point.push_back({t, 0});
      peak = std::max(peak, static_cast<float>(r.force[2]));
      if (i > 0) step = std::max(step, static_cast<float>(std::abs(r.force[2] - row[k][i - 1].force[2])));
      if (i % every) continue;
      for (size_t f = 0; f < 3; ++f) {
        double most = 0;
        for (size_t j = i; j < std::min(i + every, row[k].size()); ++j) most = std::max(most, row[k][j].force[f]);
        curve[f].point.push_back({t, std::min(most, 5.0)});
      }
    }
    plot.curve = {curve[0], curve[1], curve[2], fault};
    plot.y_most = 4;
    paste(both, draw_plot(plot, kWide, kHigh), 0, static_cast<int>(k) * kHigh);
    std::printf("%s arm: %zu ms, %.2f N at most written, largest change of its length %.3f N between two calls\n",
                k == 0 ? "right" : "left", row[k].size(), double{peak}, double{step});
  }
  write_png(both, file + ".png");
  std::printf("%zu ms with a fault\n%s.png\n", faults, file.c_str());
  return 0;
}

int bench_haptics(const std::string& folder, const std::string& scene) {
  if (!folder.empty())
    for (const char* name :
         {"/forces.csv", "/forces.png", "/z_width.csv", "/z_width.png", "/transparency.csv", "/transparency.png"})
      prepare_output(folder + name);
  std::printf("a hand presses, holds and releases a wall of tissue; in brackets the figure of an earlier prototype\n");
  std::printf("%-10s %5s  %-26s %19s %19s %19s %19s\n", "tissue/", "rate", "rendering", "force error [N]", "swing, held [mm]",
              "step [N/ms]", "energy [mJ]");
  for (const StudyPublished& p : published_study()) {
    const StudyRow r = run_study(p.c);
    std::printf("%4.0f/%-3.0f N/m %4.0f Hz  %-26s", double{p.c.tissue}, double{p.c.coupling}, double{p.c.rate},
                rendering_name(p.c.rendering));
    const auto cell = [](double ours, double prototype) {
      char text[32] = "";
      if (prototype >= 0) std::snprintf(text, sizeof text, "(%.3g)", prototype);
      std::printf(" %9.3f %9s", ours, text);
    };
    cell(double{r.force_error}, double{p.prototype.force_error});
    cell(double{r.hold_swing} * 1e3, double{p.prototype.hold_swing} * 1e3);
    cell(double{r.largest_step}, double{p.prototype.largest_step});
    cell(double{r.energy} * 1e3, double{p.prototype.energy} * 1e3);
    std::printf("\n");
  }
  write_transparency(folder);
  if (!folder.empty()) write_z_width(folder), write_felt(folder, scene);
  return stop_on_interrupt().load() ? 130 : 0;
}

}  // namespace catgut
