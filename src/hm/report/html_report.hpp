#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace hm {

/// Self-contained one-page HTML5 report: no scripts or external resources, readable on a phone, light and
/// dark mode. All text is escaped; SVG is inserted unchanged.
class HtmlReport {
 public:
  enum class Verdict { kGood, kDoubtful, kBad, kNone };  ///< kNone: a neutral statement

  explicit HtmlReport(std::string title) : title_(std::move(title)) {}

  /// Sets the main conclusion in one sentence, shown first.
  void set_verdict(Verdict verdict, std::string sentence);
  /// Key number in large print: ("surface error", "2.4", "mm", "mean; 95 % under 5.9 mm").
  struct Card {
    std::string name, value, unit, note;
  };
  void add_card(Card card) { cards_.push_back(std::move(card)); }

  /// Starts a section; everything added afterwards belongs to it.
  void begin_section(std::string heading, std::string introduction = {});
  /// Adds a figure as file bytes; the format (PNG, JPEG) is recognised from the bytes. `alt` describes it.
  void add_figure(std::span<const std::uint8_t> file_bytes, std::string alt, std::string caption);
  /// Adds an <svg> element, e.g. from plot.hpp.
  void add_svg(std::string svg, std::string caption);
  void add_table(std::vector<std::string> header, std::vector<std::vector<std::string>> rows);
  void add_paragraph(std::string text);
  /// Adds a list of notes or warnings.
  void add_list(std::vector<std::string> items);
  /// Adds preformatted text in a collapsible element (parameters, logs).
  void add_collapsible(std::string summary, std::string text);
  /// Sets a small line at the end (program version, date of the recording).
  void set_footer(std::string text) { footer_ = std::move(text); }

  [[nodiscard]] std::string html() const;

 private:
  std::string title_, verdict_html_, body_, footer_;
  std::vector<Card> cards_;
  bool in_section_ = false;
};

/// Encodes bytes as RFC 4648 base64, with padding.
std::string base64(std::span<const std::uint8_t> bytes);

}  // namespace hm
