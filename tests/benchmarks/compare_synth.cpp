// SPDX-License-Identifier: BSD-3-Clause
// Measures what makes a recording hard or easy, the same way for a made-up and a real one:
//   compare_synth SCENES_FOLDER INPUT...      INPUT: synth:SCENE?... or a TUM folder with camera.yaml
// Prints a Markdown table: ORB points and LSD lines a picture, missing depth, depth noise on planes by range,
// and the correlation of that noise between neighbouring pixels and between frames.
#include <array>
#include <cmath>
#include <cstdio>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "plumbline/core/executor.hpp"
#include "plumbline/dataset/frame_source.hpp"
#include "plumbline/sensor/depth_noise.hpp"
#include "plumbline/synth/source.hpp"

namespace {

using namespace plumbline;

constexpr int kPatch = 20;  // px; residuals are from planes fitted to such squares
constexpr int kBorder = 4;  // px left out all round: some recordings have a black frame
constexpr std::array<double, 8> kBins = {0.8, 1.2, 1.6, 2.0, 2.5, 3.0, 3.5, 4.5};

struct Correlation {
  double product = 0.0, left = 0.0, right = 0.0;
  void add(double a, double b) {
    product += a * b;
    left += a * a;
    right += b * b;
  }
  [[nodiscard]] double value() const {
    return left > 0.0 && right > 0.0 ? product / std::sqrt(left * right) : 0.0;
  }
};

struct Measures {
  double frames = 0, orb = 0, lines = 0, missing = 0, gray_noise = 0;
  std::array<double, 7> squares{}, counts{};
  Correlation lag_x1, lag_x2, lag_x4, lag_y1, frame1, frame5;
  double patches = 0, tried = 0;
};

int long_lines(const cv::Mat& gray) {
  const cv::Mat inner = gray(cv::Rect(kBorder, kBorder, gray.cols - 2 * kBorder, gray.rows - 2 * kBorder));
  std::vector<cv::Vec4f> lines;
  cv::createLineSegmentDetector(cv::LSD_REFINE_STD)->detect(inner, lines);
  int count = 0;
  for (const cv::Vec4f& l : lines) {
    if (std::hypot(l[2] - l[0], l[3] - l[1]) >= 25.0F) ++count;
  }
  return count;
}

int orb_points(const cv::Mat& gray) {
  const cv::Mat inner = gray(cv::Rect(kBorder, kBorder, gray.cols - 2 * kBorder, gray.rows - 2 * kBorder));
  std::vector<cv::KeyPoint> points;
  cv::ORB::create(1000)->detect(inner, points);
  return static_cast<int>(points.size());
}

/// Residuals z - plane of a square in which everything was measured and lies near one plane; NaN elsewhere.
/// A plane is linear in 1/z over the picture.
bool fit_patch(const cv::Mat1f& depth, int x0, int y0, cv::Mat1f& residuals) {
  cv::Mat1d a(kPatch * kPatch, 3), b(kPatch * kPatch, 1), solution;
  double mean = 0.0;
  for (int i = 0; i < kPatch * kPatch; ++i) {
    const int x = i % kPatch, y = i / kPatch;
    const float z = depth(y0 + y, x0 + x);
    if (!(z > 0.0F)) return false;
    a(i, 0) = x;
    a(i, 1) = y;
    a(i, 2) = 1.0;
    b(i, 0) = 1.0 / static_cast<double>(z);
    mean += static_cast<double>(z) / (kPatch * kPatch);
  }
  cv::solve(a, b, solution, cv::DECOMP_NORMAL);
  double sum = 0.0, worst = 0.0;
  std::array<double, kPatch * kPatch> r{};
  for (int i = 0; i < kPatch * kPatch; ++i) {
    const double w = solution(0, 0) * a(i, 0) + solution(1, 0) * a(i, 1) + solution(2, 0);
    const double z = 1.0 / b(i, 0);
    r[static_cast<std::size_t>(i)] = z - 1.0 / w;
    sum += r[static_cast<std::size_t>(i)] * r[static_cast<std::size_t>(i)];
    worst = std::max(worst, std::abs(r[static_cast<std::size_t>(i)]));
  }
  const double rms = std::sqrt(sum / (kPatch * kPatch)), sigma = sensor::depth_sigma(mean);
  if (rms > 2.5 * sigma || worst > 8.0 * sigma) return false;  // an edge or a crease
  for (int i = 0; i < kPatch * kPatch; ++i) {
    residuals(y0 + i / kPatch, x0 + i % kPatch) = static_cast<float>(r[static_cast<std::size_t>(i)]);
  }
  return true;
}

cv::Mat1f plane_residuals(const cv::Mat1f& depth, Measures& m) {
  cv::Mat1f residuals(depth.size(), std::numeric_limits<float>::quiet_NaN());
  for (int y = kBorder; y + kPatch < depth.rows; y += kPatch) {
    for (int x = kBorder; x + kPatch < depth.cols; x += kPatch) {
      m.tried += 1;
      if (fit_patch(depth, x, y, residuals)) m.patches += 1;
    }
  }
  return residuals;
}

void correlate(const cv::Mat1f& a, const cv::Mat1f& b, int dx, int dy, Correlation& out) {
  for (int y = 0; y + dy < a.rows; ++y) {
    for (int x = 0; x + dx < a.cols; ++x) {
      const auto p = static_cast<double>(a(y, x)), q = static_cast<double>(b(y + dy, x + dx));
      if (!std::isnan(p) && !std::isnan(q)) out.add(p, q);
    }
  }
}

/// Median absolute second difference of the picture: sharpness of what is smooth, that is noise (grey
/// levels).
double gray_noise(const cv::Mat& gray) {
  std::vector<int> d;
  for (int y = 10; y + 10 < gray.rows; y += 3) {
    const auto* row = gray.ptr<std::uint8_t>(y);
    for (int x = 10; x + 10 < gray.cols; ++x) d.push_back(std::abs(row[x - 3] + row[x + 3] - 2 * row[x]));
  }
  double mean = 0.0;
  std::size_t kept = 0;
  for (const int v : d) {
    if (v <= 12) {
      mean += v;
      ++kept;
    }
  }
  return kept > 0 ? mean / static_cast<double>(kept) / (std::sqrt(6.0) * 0.798) : 0.0;
}

void measure_frame(const sensor::RgbdFrame& frame, Measures& m, std::vector<cv::Mat1f>& history) {
  m.frames += 1;
  m.orb += orb_points(frame.gray);
  m.lines += long_lines(frame.gray);
  m.gray_noise += gray_noise(frame.gray);
  const cv::Mat1f depth = frame.depth;
  m.missing += 1.0 - static_cast<double>(cv::countNonZero(depth)) / static_cast<double>(depth.total());
  const cv::Mat1f r = plane_residuals(depth, m);
  for (int y = 0; y < r.rows; ++y) {
    for (int x = 0; x < r.cols; ++x) {
      if (std::isnan(r(y, x))) continue;
      const auto z = static_cast<double>(depth(y, x));
      for (std::size_t b = 0; b + 1 < kBins.size(); ++b) {
        if (z < kBins[b] || z >= kBins[b + 1]) continue;
        m.squares[b] += static_cast<double>(r(y, x)) * static_cast<double>(r(y, x));
        m.counts[b] += 1;
      }
    }
  }
  correlate(r, r, 1, 0, m.lag_x1);
  correlate(r, r, 2, 0, m.lag_x2);
  correlate(r, r, 4, 0, m.lag_x4);
  correlate(r, r, 0, 1, m.lag_y1);
  if (!history.empty()) correlate(history.back(), r, 0, 0, m.frame1);
  if (history.size() >= 5) correlate(history[history.size() - 5], r, 0, 0, m.frame5);
  history.push_back(r);
}

Measures measure(const dataset::FrameSource& source) {
  Measures m;
  std::vector<cv::Mat1f> history;
  // Runs of consecutive frames spread over the recording, so that neighbours in time can be compared.
  const std::size_t run = 10, runs = std::max<std::size_t>(1, std::min<std::size_t>(5, source.size() / run));
  for (std::size_t k = 0; k < runs; ++k) {
    const std::size_t first = runs > 1 ? k * (source.size() - std::min(run, source.size())) / (runs - 1) : 0;
    history.clear();
    for (std::size_t i = first; i < std::min(first + run, source.size()); ++i) {
      if (const auto frame = source.read(i)) measure_frame(*frame, m, history);
    }
  }
  return m;
}

void print_row(const char* name, const std::vector<Measures>& all, double (*value)(const Measures&),
               const char* format) {
  std::printf("| %s |", name);
  for (const Measures& m : all) {
    std::printf(" ");
    std::printf(format, value(m));
    std::printf(" |");
  }
  std::printf("\n");
}

void print(const std::vector<std::string>& names, const std::vector<Measures>& all) {
  std::printf("| measure |");
  for (const std::string& n : names) std::printf(" %s |", n.c_str());
  std::printf("\n|---|");
  for (std::size_t i = 0; i < names.size(); ++i) std::printf("---|");
  std::printf("\n");
  print_row(
      "ORB points a picture", all, [](const Measures& m) { return m.orb / m.frames; }, "%.0f");
  print_row(
      "LSD lines >= 25 px a picture", all, [](const Measures& m) { return m.lines / m.frames; }, "%.1f");
  print_row(
      "grey noise (levels)", all, [](const Measures& m) { return m.gray_noise / m.frames; }, "%.2f");
  print_row(
      "missing depth (%)", all, [](const Measures& m) { return 100.0 * m.missing / m.frames; }, "%.1f");
  for (std::size_t b = 0; b + 1 < kBins.size(); ++b) {
    std::printf("| depth noise, %.1f-%.1f m (mm) |", kBins[b], kBins[b + 1]);
    for (const Measures& m : all) {
      // Fewer squares than one a picture are chance: the few that a fold just passes through.
      if (m.counts[b] >= kPatch * kPatch * m.frames) {
        std::printf(" %.2f |", 1000.0 * std::sqrt(m.squares[b] / m.counts[b]));
      } else {
        std::printf(" - |");
      }
    }
    std::printf("\n");
  }
  print_row(
      "correlation, 1 px across", all, [](const Measures& m) { return m.lag_x1.value(); }, "%.2f");
  print_row(
      "correlation, 2 px across", all, [](const Measures& m) { return m.lag_x2.value(); }, "%.2f");
  print_row(
      "correlation, 4 px across", all, [](const Measures& m) { return m.lag_x4.value(); }, "%.2f");
  print_row(
      "correlation, 1 px down", all, [](const Measures& m) { return m.lag_y1.value(); }, "%.2f");
  print_row(
      "correlation, next frame", all, [](const Measures& m) { return m.frame1.value(); }, "%.2f");
  print_row(
      "correlation, 5 frames on", all, [](const Measures& m) { return m.frame5.value(); }, "%.2f");
  print_row(
      "squares that are flat (%)", all, [](const Measures& m) { return 100.0 * m.patches / m.tried; },
      "%.0f");
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: compare_synth SCENES_FOLDER INPUT...\n");
    return 2;
  }
  const core::Executor executor(1);
  const auto log = core::stderr_log(core::LogLevel::kWarning);
  std::vector<std::string> names;
  std::vector<Measures> all;
  for (int i = 2; i < argc; ++i) {
    const std::string input = argv[i];
    auto source = synth::is_synth_url(input) ? synth::open_synth(input, argv[1], executor, *log)
                                             : dataset::open_recording(input, {}, *log);
    if (!source) {
      std::fprintf(stderr, "%s\n", source.error().message.c_str());
      return 3;
    }
    names.push_back((*source)->name());
    all.push_back(measure(**source));
  }
  print(names, all);
  return 0;
}
