#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace hm {

/// Self-contained one-page HTML5 report: no external resources, no script but that of the model's view,
/// readable on a phone, light and dark mode, printable. All text is escaped; SVG is inserted unchanged.
class HtmlReport {
 public:
  enum class Verdict { kGood, kDoubtful, kBad, kNone };  ///< kNone: a neutral statement

  /// kHalf: two side by side where there is room. kStill: where the model is shown, on paper only.
  enum class Place { kWide, kHalf, kStill };
  /// One entry below a figure: a colour and what it stands for.
  struct Swatch {
    std::string color, name;  ///< CSS: "#d65420"
  };
  struct FigureText {
    std::string alt, caption;  ///< what it shows, for those who do not see it; what to know of it
    Place place = Place::kWide;
    std::vector<Swatch> legend;
    double scale_m = 0, scale_ratio = 0;  ///< a bar of this length is this share of the width; 0: no bar
  };

  /// `kind` stands small over the title: "Reconstruction" over "tum_fr1_xyz".
  explicit HtmlReport(std::string title, std::string kind = {})
      : title_(std::move(title)), kind_(std::move(kind)) {}

  /// Sets the main conclusion in one sentence, shown first.
  void set_verdict(Verdict verdict, std::string sentence);
  /// Sets the element of the model (model_view_html()), shown below the verdict; empty: none.
  void set_model(std::string model_html) { model_html_ = std::move(model_html); }
  /// Sets a figure in the place of the model, for results without one.
  void set_lead_figure(std::span<const std::uint8_t> file_bytes, const FigureText& text);
  /// Key number in large print: ("surface error", "2.4", "mm", "mean; 95 % under 5.9 mm").
  struct Card {
    std::string name, value, unit, note;
  };
  void add_card(Card card) { cards_.push_back(std::move(card)); }

  /// Starts a section; everything added afterwards belongs to it.
  void begin_section(std::string heading, std::string introduction = {});
  /// Adds a figure as file bytes; the format (PNG, JPEG) is recognised from the bytes.
  void add_figure(std::span<const std::uint8_t> file_bytes, const FigureText& text);
  void add_figure(std::span<const std::uint8_t> file_bytes, std::string alt, std::string caption) {
    add_figure(file_bytes, FigureText{std::move(alt), std::move(caption), Place::kWide, {}, 0, 0});
  }
  /// Adds a figure behind a line that unfolds it.
  void add_collapsible_figure(std::string summary, std::span<const std::uint8_t> file_bytes,
                              const FigureText& text);
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
  std::string title_, kind_, verdict_html_, model_html_, body_, footer_;
  std::vector<Card> cards_;
  std::vector<std::string> headings_;
  bool in_section_ = false;
};

/// Encodes bytes as RFC 4648 base64, with padding.
std::string base64(std::span<const std::uint8_t> bytes);

}  // namespace hm
