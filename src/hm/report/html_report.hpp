#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace hm {

/// A self-contained one-page HTML5 report: no script, no external resource, readable on a phone, light
/// and dark. All text given is escaped; SVG is inserted as it is.
class HtmlReport {
 public:
  enum class Verdict { kGood, kDoubtful, kBad, kNone };  ///< kNone: a statement, not a judgement

  explicit HtmlReport(std::string title) : title_(std::move(title)) {}

  /// The one sentence a reader must take away, shown first.
  void set_verdict(Verdict verdict, std::string sentence);
  /// A key number shown large: ("surface error", "2.4", "mm", "mean; 95 % under 5.9 mm").
  struct Card {
    std::string name, value, unit, note;
  };
  void add_card(Card card) { cards_.push_back(std::move(card)); }

  /// Starts a section; what is added afterwards belongs to it.
  void begin_section(std::string heading, std::string introduction = {});
  /// A figure as file bytes; the kind (PNG, JPEG) is seen from the bytes. `alt` says what it shows.
  void add_figure(std::span<const std::uint8_t> file_bytes, std::string alt, std::string caption);
  /// An <svg> element, as plot.hpp makes.
  void add_svg(std::string svg, std::string caption);
  void add_table(std::vector<std::string> header, std::vector<std::vector<std::string>> rows);
  void add_paragraph(std::string text);
  /// A list of notes or warnings.
  void add_list(std::vector<std::string> items);
  /// Preformatted text behind a line that unfolds it (parameters, logs).
  void add_collapsible(std::string summary, std::string text);
  /// A small line at the end (program version, date of the recording).
  void set_footer(std::string text) { footer_ = std::move(text); }

  [[nodiscard]] std::string html() const;

 private:
  std::string title_, verdict_html_, body_, footer_;
  std::vector<Card> cards_;
  bool in_section_ = false;
};

/// RFC 4648 base64, with padding.
std::string base64(std::span<const std::uint8_t> bytes);

}  // namespace hm
