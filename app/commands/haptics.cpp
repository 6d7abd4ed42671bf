// app: `catgut bench haptics`: the comparison of renderings (research notes 2.5) and, with --out, what a bite and a knot feel
// like.
#include <cmath>
#include <cstdio>

#include "commands/commands.h"
#include "core/check.h"
#include "haptic/study.h"
#include "procedure/scene_file.h"
#include "render/image.h"
#include "runtime/felt.h"
#include "suture/forces.h"

namespace catgut {
namespace {

constexpr Colour kPaper{252, 252, 250, 255}, kInk{40, 44, 48, 255}, kFaint{228, 230, 228, 255}, kOurs{30, 90, 170, 255},
    kTheirs{200, 70, 50, 255}, kBandEntry{214, 232, 214, 255}, kBandShaft{226, 222, 240, 255};

void dot(Image& image, int x, int y, Colour c) {
  if (x < 0 || y < 0 || x >= image.width || y >= image.height) return;
  std::copy(c.begin(), c.end(), image.rgba.begin() + (std::ptrdiff_t{y} * image.width + x) * 4);
}

struct Band {
  std::string name;
  double from, to;                  // [mm]
  double low0, high0, low1, high1;  // [N] at its two ends
  Colour colour;
};

// Force in newtons over millimetres, both from zero.
Image force_plot(const std::string& title, const std::string& x_name, const std::vector<FeltPoint>& curve, double x_most,
                 double y_most, const std::vector<Band>& bands) {
  Image image = make_image(760, 430, kPaper);
  const int left = 48, right = 744, top = 40, bottom = 340;
  const auto at_x = [&](double x) { return left + static_cast<int>(std::lround(x / x_most * (right - left))); };
  const auto at_y = [&](double y) {
    return bottom - static_cast<int>(std::lround(std::min(y, y_most) / y_most * (bottom - top)));
  };
  const auto line = [&](double x0, double y0, double x1, double y1, Colour c, int thick) {
    const int ax = at_x(x0), ay = at_y(y0), bx = at_x(x1), by = at_y(y1),
              n = std::max({std::abs(bx - ax), std::abs(by - ay), 1});
    for (int i = 0; i <= n; ++i)
      for (int a = 0; a < thick; ++a)
        for (int b = 0; b < thick; ++b) dot(image, ax + (bx - ax) * i / n + a, ay + (by - ay) * i / n + b, c);
  };
  int key = bottom + 44;
  for (const Band& b : bands) {
    for (int x = at_x(b.from); x <= std::min(right, at_x(b.to)); ++x) {
      const double part = (x - at_x(b.from)) / std::max(1.0, double(at_x(b.to) - at_x(b.from)));
      for (int y = at_y(b.high0 + part * (b.high1 - b.high0)); y <= at_y(b.low0 + part * (b.low1 - b.low0)); ++y)
        dot(image, x, y, b.colour);
    }
    for (int x = 0; x < 14; ++x)
      for (int y = 0; y < 8; ++y) dot(image, left + x, key + y, b.colour);
    draw_text(image, left + 20, key, b.name, kInk);
    key += 14;
  }
  char text[32];
  for (double y = 0; y <= y_most + 1e-9; y += y_most > 2 ? 0.5 : 0.25) {
    line(0, y, x_most, y, kFaint, 1);
    std::snprintf(text, sizeof text, "%g", y);
    draw_text(image, left - 6 - text_width(text), at_y(y) - 3, text, kInk);
  }
  const double step = x_most > 25 ? 5 : x_most > 10 ? 2 : 1;
  for (double x = 0; x <= x_most; x += step) {
    std::snprintf(text, sizeof text, "%g", x);
    draw_text(image, at_x(x) - text_width(text) / 2, bottom + 6, text, kInk);
  }
  line(0, 0, x_most, 0, kInk, 1), line(0, 0, 0, y_most, kInk, 1);
  for (size_t i = 1; i < curve.size(); ++i) {
    if (curve[i].mm > x_most) continue;
    line(curve[i - 1].mm, curve[i - 1].paper, curve[i].mm, curve[i].paper, kTheirs, 2);
    line(curve[i - 1].mm, curve[i - 1].ours, curve[i].mm, curve[i].ours, kOurs, 2);
  }
  draw_text(image, left, 12, title, kInk);
  draw_text(image, 8, top - 14, "N", kInk);
  draw_text(image, (left + right - text_width(x_name)) / 2, bottom + 20, x_name, kInk);
  draw_text(image, right - 220, 12, "ours", kOurs);
  draw_text(image, right - 180, 12, "the paper's spring, 1100 N/m", kTheirs);
  return image;
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
  Image both = make_image(760, 2 * 430, kPaper);
  paste(both,
        force_plot("A full bite: force on the hand against the way of the tip since it went in", "tip [mm]", c.bite,
                   std::min(25.0, std::max(10.0, c.bite.back().mm)), 3.5,
                   {{"entry peak 0.9 +- 0.3 N (research notes 3.1; skin with these needles 0.5 to 1.0 N, Maloney)", 1.5, 3.5,
                     0.6, 1.2, 0.6, 1.2, kBandEntry},
                    {"cutting 0.15 to 0.3 N and shaft 0.03 to 0.06 N/mm while the tip is in (notes 3.1)", 3.5, exit,
                     0.15 + 0.03 * 3.5, 0.3 + 0.06 * 3.5, 0.15 + 0.03 * exit, 0.3 + 0.06 * exit, kBandShaft}}),
        0, 0);
  double far = 10, most = 0;
  for (const FeltPoint& p : c.knot) far = std::max(far, p.mm), most = std::max(most, p.ours);
  paste(both,
        force_plot("Tightening the first throw: force on the pulling hand", "way of the hand since the throw was begun [mm]",
                   c.knot, far, 4,
                   {{"tying by hand 1.6 N (superficial) to 3.8 N (deep), means (Laufer 2016, notes 3.6)", 0, far, 1.6, 3.8, 1.6,
                     3.8, kBandEntry}}),
        0, 430);
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
  std::printf(
      "a hand presses, holds and lets go of a wall of tissue; in brackets the research notes' figure for their gesture\n");
  std::printf("%-10s %5s  %-26s %19s %19s %19s %19s\n", "tissue/", "rate", "rendering", "force error [N]", "swing, held [mm]",
              "step [N/ms]", "energy [mJ]");
  for (const StudyPublished& p : published_study()) {
    const StudyRow r = run_study(p.c);
    std::printf("%4.0f/%-3.0f N/m %4.0f Hz  %-26s", double{p.c.tissue}, double{p.c.coupling}, double{p.c.rate},
                rendering_name(p.c.rendering));
    const auto cell = [](double ours, double notes) {
      char text[32] = "";
      if (notes >= 0) std::snprintf(text, sizeof text, "(%.3g)", notes);
      std::printf(" %9.3f %9s", ours, text);
    };
    cell(double{r.force_error}, double{p.notes.force_error});
    cell(double{r.hold_swing} * 1e3, double{p.notes.hold_swing} * 1e3);
    cell(double{r.largest_step}, double{p.notes.largest_step});
    cell(double{r.energy} * 1e3, double{p.notes.energy} * 1e3);
    std::printf("\n");
  }
  if (!folder.empty()) write_felt(folder, scene);
  return 0;
}

}  // namespace catgut
