#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "hm/core/rng.hpp"
#include "hm/report/html_report.hpp"
#include "hm/report/plot.hpp"
#include "hm/report/render/axis_ticks.hpp"
#include "hm/report/run_report.hpp"

namespace hm {
namespace {

using testing::HasSubstr;
using testing::Not;

/// Empty when every tag is closed in order and every attribute is quoted; else the first fault.
std::string markup_fault(const std::string& text) {
  std::vector<std::string> open;
  for (std::size_t at = text.find('<'); at != std::string::npos; at = text.find('<', at + 1)) {
    const std::size_t end = text.find('>', at);
    if (end == std::string::npos) return "unclosed tag";
    const std::string tag = text.substr(at + 1, end - at - 1);
    if (tag[0] == '!' || tag.rfind("meta", 0) == 0 || tag.rfind("img", 0) == 0) continue;
    if (std::count(tag.begin(), tag.end(), '"') % 2 != 0) return "quotes: " + tag;
    if (tag[0] == '/') {
      if (open.empty() || open.back() != tag.substr(1)) return "closes " + tag;
      open.pop_back();
    } else if (tag.back() != '/') {
      open.push_back(tag.substr(0, tag.find_first_of(" \n")));
    }
  }
  return open.empty() ? "" : "left open: " + open.back();
}

PlotSeries sine(const std::string& name, SeriesStyle style) {
  PlotSeries s{name, {}, {}, style};
  for (int i = 0; i < 100; ++i) {
    s.x.push_back(0.1 * i);
    s.y.push_back(2 + std::sin(0.1 * i));
  }
  return s;
}

PlotOptions labelled() {
  PlotOptions options;
  options.title = "Speed & <size>";
  options.x.label = "time (s)";
  options.y.label = "integration (ms)";
  return options;
}

TEST(NiceTicks, OneTwoFive) {
  EXPECT_THAT(nice_ticks(0, 10, 5), testing::ElementsAre(0, 2, 4, 6, 8, 10));
  EXPECT_THAT(nice_ticks(-0.3, 0.31, 3), testing::Pointwise(testing::DoubleNear(1e-12), {-0.2, 0.0, 0.2}));
  EXPECT_TRUE(nice_ticks(1, 1, 5).empty());
  EXPECT_TRUE(nice_ticks(0, std::numeric_limits<double>::infinity(), 5).empty());
  Rng rng(1);
  for (int i = 0; i < 300; ++i) {
    const double low = rng.uniform(-100, 100), span = std::pow(10, rng.uniform(-6, 6));
    const std::vector<double> ticks = nice_ticks(low, low + span, 6);
    EXPECT_GE(ticks.size(), 2u);
    EXPECT_LE(ticks.size(), 8u);
    EXPECT_GE(ticks.front(), low - 1e-6 * span);
    EXPECT_LE(ticks.back(), low + span * (1 + 1e-6));
  }
}

TEST(Plot, EveryKindIsWellFormedAndSelfContained) {
  PlotOptions options = labelled();
  options.marks = {{PlotMark::Direction::kVertical, 5, "median <5>"},
                   {PlotMark::Direction::kHorizontal, 2, "bar"}};
  PlotOptions log = options;
  log.y.scale = log.x.scale = AxisScale::kLog;
  const std::vector<PlotSeries> series{sine("line", SeriesStyle::kLine), sine("area", SeriesStyle::kArea),
                                       sine("a \"dot\"", SeriesStyle::kScatter),
                                       sine("step", SeriesStyle::kStep)};
  const std::vector<float> values{1, 2, 2, 3, 3, 3, 4, 100, std::nanf("")};
  Trajectory path;
  for (int i = 0; i < 50; ++i)
    path.push_back({Time{i}, SE3(Mat3::Identity(), Vec3(0.1 * i, std::sin(0.1 * i), 0))});
  const NamedTrajectory named{"estimate", &path};
  for (const std::string& svg :
       {plot_svg(series, options), plot_svg(series, log), stacked_series_svg(series, options),
        histogram_svg(values, 10, labelled()), trajectory_svg(std::span(&named, 1), labelled())}) {
    EXPECT_EQ(markup_fault(svg), "");
    EXPECT_THAT(svg, HasSubstr("Speed &amp; &lt;size&gt;"));
    EXPECT_THAT(svg, Not(HasSubstr("nan")));
    EXPECT_THAT(svg, Not(HasSubstr("inf")));
    EXPECT_THAT(svg, Not(HasSubstr("<script")));
    EXPECT_THAT(svg, Not(HasSubstr("href")));
  }
  EXPECT_THAT(plot_svg(series, options), HasSubstr("a &quot;dot&quot;"));
  EXPECT_THAT(plot_svg(series, options), HasSubstr("median &lt;5&gt;"));
}

/// The path data of the one curve drawn in the first series' colour.
std::string curve(const std::string& svg) {
  const std::size_t stroke = svg.find("fill=\"none\" stroke=\"var(--s0)\"");
  const std::size_t begin = svg.rfind(" d=\"", stroke) + 4;
  return svg.substr(begin, svg.find('"', begin) - begin);
}

TEST(Plot, PointsLandWhereTheAxesSay) {
  PlotOptions options;
  options.x = {"x", AxisScale::kLinear, 0, 10};
  options.y = {"y", AxisScale::kLinear, 0, 100};
  const PlotSeries line{"", {0, 5, 10}, {0, 50, 100}};
  // The drawing area is x 61.2..444 (numbers of three letters stand at its left), y 12..252.
  EXPECT_EQ(curve(plot_svg(std::span(&line, 1), options)), "M61.2 252.0L252.6 132.0L444.0 12.0");
  options.y = {"y", AxisScale::kLog, 1, 100};
  const PlotSeries decades{"", {0, 5, 10}, {1, 10, 100}};
  EXPECT_EQ(curve(plot_svg(std::span(&decades, 1), options)), "M61.2 252.0L252.6 132.0L444.0 12.0");
}

TEST(Plot, GapsAndNothingToDraw) {
  const double nan = std::nan("");
  PlotSeries gap{"", {0, 1, 2, 3, 4}, {1, 2, nan, 2, 1}};
  const std::string svg = plot_svg(std::span(&gap, 1), {});
  std::size_t curves = 0;
  for (std::size_t at = svg.find("stroke=\"var(--s0)\""); at != std::string::npos;
       at = svg.find("stroke=\"var(--s0)\"", at + 1))
    ++curves;
  EXPECT_EQ(curves, 2u);
  gap.y.assign(5, nan);
  EXPECT_THAT(plot_svg(std::span(&gap, 1), {}), HasSubstr("no data"));
  EXPECT_THAT(plot_svg({}, {}), HasSubstr("no data"));
  EXPECT_THAT(histogram_svg({}, 5, {}), HasSubstr("no data"));
  EXPECT_THAT(stacked_series_svg({}, {}), HasSubstr("no data"));
  EXPECT_THAT(trajectory_svg({}, {}), HasSubstr("no data"));
  PlotSeries constant{"", {1, 1}, {7, 7}};
  EXPECT_EQ(markup_fault(plot_svg(std::span(&constant, 1), {})), "");
  PlotOptions log;
  log.y.scale = AxisScale::kLog;
  PlotSeries negative{"", {1, 2}, {-1, 0}};
  EXPECT_THAT(plot_svg(std::span(&negative, 1), log), HasSubstr("no data"));
}

TEST(Plot, HistogramSharesAndOutliers) {
  std::vector<float> values;
  for (int i = 0; i < 90; ++i) values.push_back(0.5F);
  for (int i = 0; i < 10; ++i) values.push_back(99);
  PlotOptions options;
  options.x = {"error (mm)", AxisScale::kLinear, 0, 2};
  options.y = {"", AxisScale::kLinear, 0, 100};
  const std::string svg = histogram_svg(values, 2, options);
  EXPECT_THAT(svg, HasSubstr("error (mm); 10 % outside"));
  EXPECT_EQ(curve(svg), "M61.2 36.0L252.6 36.0L252.6 252.0L444.0 252.0");  // 90 % high, then nothing
}

TEST(Plot, LongRunsAreThinned) {
  PlotSeries run{"stage", {}, {}};
  for (int i = 0; i < 100'000; ++i) {
    run.x.push_back(i);
    run.y.push_back(1);
  }
  EXPECT_LT(stacked_series_svg(std::span(&run, 1), {}).size(), 20'000u);
}

/// The numbers of an attribute, in the order of the text.
std::vector<double> attribute(const std::string& svg, const std::string& name) {
  std::vector<double> values;
  for (std::size_t at = svg.find(name + "=\""); at != std::string::npos; at = svg.find(name + "=\"", at + 1))
    values.push_back(std::stod(svg.substr(at + name.size() + 2)));
  return values;
}

TEST(Plot, LongLabelsAndLongNumbersStayInside) {
  PlotOptions options;
  options.x.label =
      "signed error (mm), positive in front of the true surface; 1.3 % outside of what is drawn";
  const PlotSeries line{"", {0, 1}, {1'000'000, 3'000'000}};
  const std::string svg = plot_svg(std::span(&line, 1), options);
  const std::size_t begin = svg.find(">signed error");
  EXPECT_LT(svg.find('<', begin) - begin, 60u) << "the label is broken into lines";
  EXPECT_THAT(svg, HasSubstr("drawn</text>"));
  for (const double y : attribute(svg, " y")) EXPECT_LT(y, options.height_px);
  EXPECT_GT(std::stod(curve(svg).substr(1)), 36 + 7 * 8);  // numbers of seven digits beside the axis
}

TEST(Plot, ColorBarStandsOverThePlotAndUnnamedSeriesHaveNoLegend) {
  PlotOptions options;
  options.color_bar = {{"#00ff00", "#ff0000"}, "0", "24 mm"};
  const std::vector<PlotSeries> series{{"", {0, 1}, {0, 1}, SeriesStyle::kLine, "#00ff00"},
                                       {"", {1, 2}, {1, 0}, SeriesStyle::kLine, "#ff0000"}};
  const std::string svg = plot_svg(series, options);
  EXPECT_EQ(markup_fault(svg), "");
  EXPECT_THAT(svg, HasSubstr("24 mm"));
  EXPECT_THAT(svg, HasSubstr("stroke=\"#ff0000\""));
  EXPECT_EQ(svg.find("rx=\"2\""), std::string::npos);
}

TEST(Base64, KnownVectors) {  // RFC 4648, section 10
  const auto encode = [](std::string_view s) {
    return base64({reinterpret_cast<const std::uint8_t*>(s.data()), s.size()});
  };
  EXPECT_EQ(encode(""), "");
  EXPECT_EQ(encode("f"), "Zg==");
  EXPECT_EQ(encode("fo"), "Zm8=");
  EXPECT_EQ(encode("foo"), "Zm9v");
  EXPECT_EQ(encode("foobar"), "Zm9vYmFy");
  EXPECT_EQ(encode("\xff\xfe\xfd"), "//79");
}

TEST(HtmlReport, ContainsWhatWasGivenEscapedAndNothingExternal) {
  HtmlReport report("House <1>");
  report.set_verdict(HtmlReport::Verdict::kGood, "The model is within 3 mm & complete.");
  report.add_card({"surface error", "2.4", "mm", "95 % < 6 mm"});
  report.begin_section("Pictures", "What it looks like.");
  const std::vector<std::uint8_t> png{0x89, 'P', 'N', 'G'}, jpeg{0xff, 0xd8, 0xff};
  report.add_figure(png, "shaded \"view\"", "from above");
  report.add_figure(jpeg, "photo", "");
  report.begin_section("Numbers");
  const PlotSeries line = sine("ms", SeriesStyle::kLine);
  report.add_svg(plot_svg(std::span(&line, 1), {}), "time per frame");
  report.add_table({"what", "value"}, {{"volumes", "1,234"}, {"<b>", "&"}});
  report.add_list({"3 frames could not be read"});
  report.add_collapsible("Parameters", "[tsdf]\nvoxel_size_m = 0.02 # <m>\n");
  report.set_footer("housemartin 0.1.0");
  const std::string html = report.html();
  EXPECT_EQ(markup_fault(html), "");
  EXPECT_EQ(html.rfind("<!DOCTYPE html>", 0), 0u);
  for (const char* part :
       {"<title>House &lt;1&gt;</title>", "within 3 mm &amp; complete", "data:image/png;base64,iVBORw==",
        "data:image/jpeg;base64,/9j/", "alt=\"shaded &quot;view&quot;\"", "<td>&lt;b&gt;</td>",
        "voxel_size_m = 0.02 # &lt;m&gt;", "name=\"viewport\"", "housemartin 0.1.0", "<svg"})
    EXPECT_THAT(html, HasSubstr(part));
  for (const char* external : {"<script", "<link", "src=\"http", "@import", "url("})
    EXPECT_THAT(html, Not(HasSubstr(external)));
}

TEST(HtmlReport, ModelComesBeforeTheNumbersAndLongPagesHaveContents) {
  HtmlReport report("tum_fr1_xyz", "Reconstruction");
  report.set_verdict(HtmlReport::Verdict::kGood, "4 m.");
  report.add_card({"frames", "101", "", ""});
  for (const char* heading : {"One", "Two", "Three"}) report.begin_section(heading);
  EXPECT_THAT(report.html(), Not(HasSubstr("<nav")));
  report.begin_section("Four & more");
  report.set_model("<div class=\"model\"></div>");
  const std::string html = report.html();
  EXPECT_THAT(html, HasSubstr("<title>tum_fr1_xyz - Reconstruction</title>"));
  EXPECT_THAT(html, HasSubstr("<a href=\"#s4\">Four &amp; more</a>"));
  EXPECT_THAT(html, HasSubstr("<section id=\"s4\">"));
  const std::size_t verdict = html.find("class=\"verdict"), model = html.find("class=\"model"),
                    cards = html.find("class=\"cards"), contents = html.find("<nav"),
                    script = html.find("<script");
  EXPECT_LT(verdict, model);
  EXPECT_LT(model, cards);
  EXPECT_LT(cards, contents);
  EXPECT_LT(contents, script);
  const std::vector<std::uint8_t> png{0x89, 'P', 'N', 'G'};
  report.set_lead_figure(png, {"map", "", HtmlReport::Place::kWide, {{"#d65420", "path <1>"}}, 5, 0.25});
  EXPECT_THAT(report.html(), Not(HasSubstr("<script")));
  for (const char* part : {"width:25.00%", "5 m", "--swatch:#d65420", "path &lt;1&gt;"})
    EXPECT_THAT(report.html(), HasSubstr(part));
}

TEST(RunReport, FolderTitleSaysMoreThanRecording) {
  EXPECT_EQ(folder_title("/data/rgbd/tum_fr1_xyz"), "tum_fr1_xyz");
  EXPECT_EQ(folder_title("/data/rgbd/tum_fr1_xyz/"), "tum_fr1_xyz");
  EXPECT_EQ(folder_title("/data/flat/recording"), "flat/recording");
  EXPECT_EQ(folder_title("/data/flat/2024"), "flat/2024");
  EXPECT_EQ(folder_title("."), folder_title(std::filesystem::current_path()));
}

}  // namespace
}  // namespace hm
