#include "hm/report/summary_tree.hpp"

#include <gtest/gtest.h>

#include "hm/io/bytes/json.hpp"
#include "hm/report/run_report.hpp"

namespace hm {
namespace {

struct Loop {
  int frame = 0;
  std::optional<double> shift_m;
};

struct Loops {
  std::size_t candidates = 0, accepted = 0;
  std::vector<Loop> list;
};

struct RunFacts {
  double time_s = 0;
  std::optional<double> error_m;
  std::optional<Loops> loops;
};

void visit(const Loop& loop, SummaryTree& v) {
  v({"frame", "frame"}, loop.frame);
  v({"shift_m", "shift", "{:.1f} mm", 1e3}, loop.shift_m);
}

void visit(const Loops& loops, SummaryTree& v) {
  v({"candidates", "candidates"}, loops.candidates);
  v({"accepted", "accepted"}, loops.accepted);
  v.shown("refused", "refused", loops.candidates - loops.accepted);
  v.list("list", loops.list);
}

void visit(const RunFacts& run, SummaryTree& v) {
  const std::vector<double> times{1, 2, 4};
  v({"run_s", "time", "{:.1f} s"}, run.time_s);
  v.spread({"frame_ms", "a frame", "{:.0f} ms"}, summarise(times), {"median", "max"});
  v({"error_m", "error", "{:.1f} cm", 1e2}, run.error_m);
  v.group("loops", run.loops);
  v.json("seed", 7);
}

RunFacts full_run() { return {1.25, 0.0123, Loops{5, 2, {{10, 0.004}, {20, std::nullopt}}}}; }

TEST(SummaryTree, JsonHoldsTheValuesAsTheyAre) {
  EXPECT_EQ(
      to_json_text(describe(full_run()).json(), JsonStyle::kCompact),
      R"({"run_s":1.25,"frame_ms":{"median":2.0,"max":4.0},"error_m":0.0123,)"
      R"("loops":{"candidates":5,"accepted":2,"list":[{"frame":10,"shift_m":0.004},{"frame":20}]},"seed":7})");
}

TEST(SummaryTree, KeysWithoutAValueAreLeftOut) {
  EXPECT_EQ(to_json_text(describe(RunFacts{}).json(), JsonStyle::kCompact),
            R"({"run_s":0.0,"frame_ms":{"median":2.0,"max":4.0},"seed":7})");
}

TEST(SummaryTree, SentencesPrintValuesWithTheirUnits) {
  const SummaryTree tree = describe(full_run());
  EXPECT_EQ(tree.sentence("{loops.accepted} of {loops.candidates} in {run_s}"), "2 of 5 in 1.2 s");
  EXPECT_EQ(tree.sentence("{frame_ms.median}[, error {error_m}]"), "2 ms, error 1.2 cm");
}

TEST(SummaryTree, SentencesWithoutAValueAreLeftOut) {
  const SummaryTree tree = describe(RunFacts{});
  EXPECT_EQ(tree.sentence("error {error_m}"), std::nullopt);
  EXPECT_EQ(tree.sentence("{frame_ms.max}[, error {error_m}] a frame"), "4 ms a frame");
  EXPECT_EQ(tree.lines({"took {run_s}", "error {error_m}", "{frame_ms.max} at most"}),
            "took 0.0 s\n4 ms at most\n");
}

TEST(SummaryTree, TablesShowWhatHasALabel) {
  const SummaryTree tree = describe(full_run());
  EXPECT_EQ(tree.rows("frame_ms"),
            (SummaryTree::Rows{{"a frame, median", "2 ms"}, {"a frame, max", "4 ms"}}));
  EXPECT_EQ(tree.rows("loops"),
            (SummaryTree::Rows{{"candidates", "5"}, {"accepted", "2"}, {"refused", "3"}}));
  const SummaryTree::Table table = tree.table("loops.list");
  EXPECT_EQ(table.header, (std::vector<std::string>{"frame", "shift"}));
  EXPECT_EQ(table.rows, (SummaryTree::Rows{{"10", "4.0 mm"}, {"20", "-"}}));
}

TEST(SummaryTree, LargeNumbersAreGrouped) {
  SummaryTree tree;
  tree({"a", ""}, 999);
  tree({"b", ""}, 1000);
  tree({"c", ""}, -1234567);
  EXPECT_EQ(tree.sentence("{a} {b} {c}"), "999 1,000 -1,234,567");
}

TEST(SummaryTree, NamesAreNotGrouped) {
  SummaryTree tree;
  tree({"width_px", "", "{:d}"}, 1920);
  EXPECT_EQ(tree.sentence("{width_px} px"), "1920 px");
}

TEST(SummaryTree, CountsAgreeWithTheirNouns) {
  SummaryTree tree;
  tree({"loops"}, 1);
  tree({"frames"}, 2529);
  tree({"vertices"}, 0);
  tree.shown("threads", {}, std::size_t{1});
  tree.object("map", [](SummaryTree& map) { map({"vertices"}, 1); });
  EXPECT_EQ(tree.sentence("{loops|loop}, {frames|frame}, {vertices|vertex|vertices}, {threads|thread}"),
            "1 loop, 2,529 frames, 0 vertices, 1 thread");
  EXPECT_EQ(tree.sentence("{map.vertices|vertex|vertices}"), "1 vertex");
  EXPECT_EQ(tree.sentence("{no_such|loop}"), std::nullopt);
}

TEST(SummaryTree, CardsAndTablesOfAReport) {
  HtmlReport report("run");
  const SummaryTree tree = describe(full_run());
  add_cards(report, tree, {{"error", "{error_m}", "after {run_s}"}, {"missing", "{no_such}", ""}});
  add_summary_table(report, tree, "loops");
  add_list_table(report, tree, "loops.list");
  const std::string html = report.html();
  EXPECT_NE(html.find("1.2 <span class=\"unit\">cm</span>"), std::string::npos);
  EXPECT_NE(html.find("after 1.2 s"), std::string::npos);
  EXPECT_EQ(html.find("missing"), std::string::npos);
  EXPECT_NE(html.find("<td>refused</td><td>3</td>"), std::string::npos);
  EXPECT_NE(html.find("<td>20</td><td>-</td>"), std::string::npos);
}

}  // namespace
}  // namespace hm
