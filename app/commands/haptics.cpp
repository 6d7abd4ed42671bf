// app: `catgut bench haptics`: the comparison of rendering methods and, with --out, what a bite and a knot feel
// like.
#include <cmath>
#include <cstdio>

#include "commands/commands.h"
#include "core/check.h"
#include "haptic/study.h"
#include "procedure/scene_file.h"
#include "render/plot.h"
#include "runtime/felt.h"
#include "suture/forces.h"

namespace catgut {
namespace {

constexpr Colour kOurs{30, 90, 170, 255}, kTheirs{200, 70, 50, 255}, kBandEntry{214, 232, 214, 255},
    kBandShaft{226, 222, 240, 255};
constexpr int kWide = 760, kHigh = 430;

// Force in newtons over millimetres, both from zero.
Plot force_plot(const std::string& title, const std::string& x_name, const std::vector<FeltPoint>& felt) {
  Plot plot;
  plot.title = title, plot.x_name = x_name, plot.y_name = "N";
  plot.y_axis = PlotAxis::linear;
  PlotCurve ours{"ours", kOurs, {}, true, false}, theirs{"the paper's spring, 1100 N/m", kTheirs, {}, true, false};
  for (const FeltPoint& p : felt) ours.point.push_back({p.mm, p.ours}), theirs.point.push_back({p.mm, p.paper});
  plot.curve = {theirs, ours};
  return plot;
}

// The purse-string's bite runs along the wall and comes out again; the stay suture's is through and through, and has the knot.
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

}  // namespace

int bench_haptics(const std::string& folder, const std::string& scene) {
  if (!folder.empty())
    for (const char* name : {"/forces.csv", "/forces.png"}) prepare_output(folder + name);
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
  if (!folder.empty()) write_felt(folder, scene);
  return 0;
}

}  // namespace catgut
