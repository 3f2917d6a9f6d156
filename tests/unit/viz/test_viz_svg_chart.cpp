// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>

#include "../../../viz/canvas/ticks.hpp"
#include "../../markup.hpp"
#include "plumbline/viz/svg_chart.hpp"

namespace plumbline::viz {
namespace {

using testing_markup::count_of;
using testing_markup::malformed_at;

const double kNaN = std::nan("");

SvgChart chart_of(SvgLine line) {
  SvgChart chart;
  chart.x_label = "time (s)";
  chart.y_label = "error (mm)";
  chart.lines.push_back(std::move(line));
  return chart;
}

/// The d of the first curve.
std::string path_of(const std::string& svg) {
  const std::string mark = "<path class=\"line k0\" d=\"";
  const std::size_t from = svg.rfind(mark) + mark.size();
  return svg.substr(from, svg.find('"', from) - from);
}

TEST(MarkupText, EscapesAndReplacesWhatNoDocumentMayHold) {
  EXPECT_EQ(markup_text("a<b>&\"c'"), "a&lt;b&gt;&amp;&quot;c&#39;");
  EXPECT_EQ(markup_text("Küche 12 µm – 全"), "Küche 12 µm – 全");
  const std::string bad = "\xEF\xBF\xBD";
  EXPECT_EQ(markup_text(std::string_view("a\0b", 3)), "a" + bad + "b");
  EXPECT_EQ(markup_text("\x1b[1m"), bad + "[1m");
  EXPECT_EQ(markup_text("\xFF<\xC3"), bad + "&lt;" + bad);            // no UTF-8, cut short
  EXPECT_EQ(markup_text("\xC0\xBC"), bad + bad);                      // '<', overlong
  EXPECT_EQ(markup_text("\xED\xA0\x80"), bad + bad + bad);            // a surrogate
  EXPECT_EQ(markup_text("\xF4\x90\x80\x80"), bad + bad + bad + bad);  // beyond Unicode
  EXPECT_EQ(markup_text("\xEF\xBF\xBE"
                        "x"),
            bad + bad + bad + "x");               // no character
  EXPECT_EQ(markup_text("\xC2\x85"), bad + bad);  // a control character
  EXPECT_EQ(markup_text("one\n\ttwo"), "one\n\ttwo");
  EXPECT_EQ(markup_text(""), "");
}

TEST(SvgChart, IsWellFormedWhateverItsLabels) {
  SvgChart chart = chart_of({"<b>\"&", "k0", {0.0, 1.0}, {1.0, 2.0}});
  chart.title = "</svg>'";
  chart.dots.push_back({"dots & more", "k1", {0.5}, {1.5}, 2.5, true});
  chart.bands.push_back({"lost", 0.2, 0.4});
  const std::string svg = svg_chart(chart);
  EXPECT_EQ(malformed_at(svg), "") << svg;
  EXPECT_NE(svg.find("time (s)"), std::string::npos);
  EXPECT_NE(svg.find("&lt;b&gt;&quot;&amp;"), std::string::npos);
  EXPECT_EQ(count_of("band-lost", svg), 1U);
  EXPECT_EQ(svg.find("id="), std::string::npos);
  EXPECT_EQ(svg, svg_chart(chart));
}

TEST(SvgChart, DrawsWhatIsNotThereAsNothing) {
  for (const SvgLine& line :
       {SvgLine{}, SvgLine{"", "k0", {kNaN, kNaN}, {1.0, kNaN}}, SvgLine{"", "k0", {3.0}, {7.0}},
        SvgLine{"", "k0", {1e18, 1e18 + 256}, {-1e18, -1e18 - 256}},
        SvgLine{"", "k0", {1.0, 1.0}, {2.0, 2.0}},
        SvgLine{"", "k0", {0.0, INFINITY, 1.0}, {1.0, 2.0, -INFINITY}}}) {
    for (const bool equal : {false, true}) {
      SvgChart chart = chart_of(line);
      chart.equal_aspect = equal;
      const std::string svg = svg_chart(chart);
      EXPECT_EQ(malformed_at(svg), "");
      EXPECT_EQ(svg.find("nan"), std::string::npos) << svg;
      EXPECT_EQ(svg.find("inf"), std::string::npos) << svg;
    }
  }
}

TEST(SvgChart, NanBreaksTheLine) {
  const std::string whole = path_of(svg_chart(chart_of({"", "k0", {0, 1, 2, 3}, {0, 1, 0, 1}})));
  const std::string broken = path_of(svg_chart(chart_of({"", "k0", {0, 1, 2, 3}, {0, 1, kNaN, 1}})));
  EXPECT_EQ(count_of("M", whole), 1U) << whole;
  EXPECT_EQ(count_of("M", broken), 2U) << broken;
}

TEST(SvgChart, ThinsLongCurvesAndKeepsTheirPeaks) {
  SvgLine line{"", "k0", {}, {}};
  for (int i = 0; i < 200000; ++i) {
    line.x.push_back(i);
    line.y.push_back(std::sin(0.01 * i));
  }
  line.y[123456] = 50.0;
  SvgChart chart = chart_of(line);
  chart.y_range = AxisRange{-2.0, 50.0};
  const std::string path = path_of(svg_chart(chart));
  EXPECT_LT(path.size(), 120000U);
  EXPECT_NE(path.find(",0.0"), std::string::npos);  // the peak, at the upper edge
}

TEST(SvgChart, OneScaleForBothAxesOfAPlan) {
  // A square of 2 m: circles at its corners must be as far apart across as up.
  SvgChart chart;
  chart.equal_aspect = true;
  chart.dots.push_back({"", "k0", {0.0, 2.0, 0.0}, {0.0, 0.0, 2.0}, 2.0, false});
  const std::string svg = svg_chart(chart);
  std::vector<double> x, y;
  for (std::size_t at = svg.find("cx=\""); at != std::string::npos; at = svg.find("cx=\"", at + 1)) {
    x.push_back(std::stod(svg.substr(at + 4)));
    y.push_back(std::stod(svg.substr(svg.find("cy=\"", at) + 4)));
  }
  ASSERT_EQ(x.size(), 3U);
  EXPECT_NEAR(x[1] - x[0], y[0] - y[2], 0.2);
  EXPECT_GT(x[1] - x[0], 100.0);
}

TEST(Ticks, AreRoundAndLabelledAlike) {
  std::vector<std::string> labels;
  for (const Tick& tick : nice_ticks(-0.25, 1.0, 0.2)) labels.push_back(tick.label);
  EXPECT_EQ(labels, (std::vector<std::string>{"-0.2", "0.0", "0.2", "0.4", "0.6", "0.8", "1.0"}));
  EXPECT_TRUE(nice_ticks(1.0, 1.0, 0.1).empty());
  EXPECT_TRUE(nice_ticks(0.0, kNaN, 0.1).empty());
}

TEST(SvgDocument, HoldsChartsSideBySideWithTitlesAndLegends) {
  SvgChart chart = chart_of({"error <m>", "e4", {0.0, 1.0}, {1.0, 2.0}});
  chart.title = "Over & under";
  const std::string svg = svg_document({chart, chart, chart}, 2);
  EXPECT_EQ(malformed_at(svg), "") << svg;
  EXPECT_EQ(svg.rfind("<svg xmlns=", 0), 0U);
  EXPECT_NE(svg.find("width=\"2000\""), std::string::npos);
  EXPECT_EQ(count_of("Over &amp; under", svg), 3U);
  EXPECT_EQ(count_of("error &lt;m&gt;", svg), 3U);
  EXPECT_NE(svg.find(".line.e4"), std::string::npos);
  EXPECT_EQ(malformed_at(svg_document({}, 2)), "");
}

TEST(SvgChart, StyleHasEveryKindInLightAndDark) {
  const std::string css = svg_chart_style();
  for (int i = 0; i < 8; ++i) EXPECT_EQ(count_of(".k" + std::to_string(i) + "{", css), 2U) << i;
  EXPECT_EQ(css.find('<'), std::string::npos);
  EXPECT_EQ(css.find("url("), std::string::npos);
}

}  // namespace
}  // namespace plumbline::viz
