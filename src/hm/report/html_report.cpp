#include "hm/report/html_report.hpp"

#include <fmt/format.h>

#include <string_view>

#include "hm/core/check.hpp"
#include "hm/report/page_resources.hpp"
#include "hm/report/plot.hpp"

namespace hm {
namespace {

/// Pages with fewer sections need no table of contents.
constexpr std::size_t kContentsFrom = 4;

std::string_view media_type(std::span<const std::uint8_t> bytes) {
  return bytes.size() > 2 && bytes[0] == 0xff && bytes[1] == 0xd8 ? "image/jpeg" : "image/png";
}

std::string card_html(const HtmlReport::Card& card) {
  std::string html = fmt::format("<li><div class=\"name\">{}</div><div class=\"value\">{}",
                                 escape_markup(card.name), escape_markup(card.value));
  if (!card.unit.empty()) html += fmt::format(" <span class=\"unit\">{}</span>", escape_markup(card.unit));
  html += "</div>";
  if (!card.note.empty()) html += fmt::format("<div class=\"note\">{}</div>", escape_markup(card.note));
  return html + "</li>\n";
}

std::string_view class_of(HtmlReport::Place place) {
  return place == HtmlReport::Place::kHalf ? "half" : place == HtmlReport::Place::kStill ? "still" : "wide";
}

std::string figure_html(const std::string& content, std::string_view kind, const std::string& caption) {
  const std::string text =
      caption.empty() ? std::string() : "<figcaption>" + escape_markup(caption) + "</figcaption>";
  return fmt::format("<figure class=\"{}\">{}{}</figure>\n", kind, content, text);
}

/// A bar as wide as a share of the image above it.
std::string scale_html(const HtmlReport::FigureText& text) {
  if (!(text.scale_m > 0)) return {};
  return fmt::format("<div class=\"scale\" style=\"width:{:.2f}%\"></div><div class=\"note\">{:g} m</div>",
                     100 * text.scale_ratio, text.scale_m);
}

std::string legend_html(const HtmlReport::FigureText& text) {
  if (text.legend.empty()) return {};
  std::string html = "<div class=\"legend\">";
  for (const HtmlReport::Swatch& swatch : text.legend)
    html += fmt::format("<span class=\"swatch\" style=\"--swatch:{}\">{}</span>", escape_markup(swatch.color),
                        escape_markup(swatch.name));
  return html + "</div>";
}

std::string image_figure_html(std::span<const std::uint8_t> file_bytes, const HtmlReport::FigureText& text) {
  HM_CHECK(!file_bytes.empty(), "{}", text.alt);
  return figure_html(fmt::format("<div class=\"image\"><img src=\"data:{};base64,{}\" alt=\"{}\">{}</div>{}",
                                 media_type(file_bytes), base64(file_bytes), escape_markup(text.alt),
                                 scale_html(text), legend_html(text)),
                     class_of(text.place), text.caption);
}

/// Links to the sections, which are numbered.
std::string contents_html(const std::vector<std::string>& headings) {
  if (headings.size() < kContentsFrom) return {};
  std::string html = "<nav aria-label=\"contents\">\n";
  for (std::size_t i = 0; i < headings.size(); ++i)
    html += fmt::format("<a href=\"#s{}\">{}</a>\n", i + 1, escape_markup(headings[i]));
  return html + "</nav>\n";
}

}  // namespace

std::string base64(std::span<const std::uint8_t> bytes) {
  static constexpr std::string_view kAlphabet =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t available = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k) group = (group << 8U) | (k < available ? bytes[i + k] : 0U);
    for (std::size_t k = 0; k < 4; ++k)
      out += k <= available ? kAlphabet[(group >> (18 - 6 * k)) & 63U] : '=';
  }
  return out;
}

void HtmlReport::set_verdict(Verdict verdict, std::string sentence) {
  const std::string_view kind = verdict == Verdict::kGood       ? "good"
                                : verdict == Verdict::kDoubtful ? "doubtful"
                                : verdict == Verdict::kNone     ? "none"
                                                                : "bad";
  verdict_html_ = fmt::format("<p class=\"verdict {}\">{}</p>\n", kind, escape_markup(sentence));
}

void HtmlReport::begin_section(std::string heading, std::string introduction) {
  if (in_section_) body_ += "</section>\n";
  in_section_ = true;
  headings_.push_back(heading);
  body_ += fmt::format("<section id=\"s{}\">\n<h2>{}</h2>\n", headings_.size(), escape_markup(heading));
  if (!introduction.empty()) add_paragraph(std::move(introduction));
}

void HtmlReport::add_figure(std::span<const std::uint8_t> file_bytes, const FigureText& text) {
  body_ += image_figure_html(file_bytes, text);
}

void HtmlReport::set_lead_figure(std::span<const std::uint8_t> file_bytes, const FigureText& text) {
  model_html_ = image_figure_html(file_bytes, text);
}

void HtmlReport::add_collapsible_figure(std::string summary, std::span<const std::uint8_t> file_bytes,
                                        const FigureText& text) {
  body_ += fmt::format("<details><summary>{}</summary>{}</details>\n", escape_markup(summary),
                       image_figure_html(file_bytes, text));
}

void HtmlReport::add_svg(std::string svg, std::string caption) { body_ += figure_html(svg, "plot", caption); }

void HtmlReport::add_table(std::vector<std::string> header, std::vector<std::vector<std::string>> rows) {
  body_ += "<div class=\"scroll\"><table>\n<thead><tr>";
  for (const std::string& cell : header) body_ += "<th>" + escape_markup(cell) + "</th>";
  body_ += "</tr></thead>\n<tbody>\n";
  for (const auto& row : rows) {
    HM_CHECK(row.size() == header.size(), "{} cells under {} headings", row.size(), header.size());
    body_ += "<tr>";
    for (const std::string& cell : row) body_ += "<td>" + escape_markup(cell) + "</td>";
    body_ += "</tr>\n";
  }
  body_ += "</tbody></table></div>\n";
}

void HtmlReport::add_paragraph(std::string text) { body_ += "<p>" + escape_markup(text) + "</p>\n"; }

void HtmlReport::add_list(std::vector<std::string> items) {
  if (items.empty()) return;
  body_ += "<ul>\n";
  for (const std::string& item : items) body_ += "<li>" + escape_markup(item) + "</li>\n";
  body_ += "</ul>\n";
}

void HtmlReport::add_collapsible(std::string summary, std::string text) {
  body_ += fmt::format("<details><summary>{}</summary><pre>{}</pre></details>\n", escape_markup(summary),
                       escape_markup(text));
}

std::string HtmlReport::html() const {
  const std::string kind = escape_markup(kind_), title = escape_markup(title_);
  std::string html = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" "
      "content=\"width=device-width, "
      "initial-scale=1\">\n<title>{}{}</title>\n<style>\n{}</style>\n</head>\n<body>\n"
      "<main>\n{}<h1>{}</h1>\n{}{}",
      title, kind.empty() ? "" : " - " + kind, report_css(),
      kind.empty() ? "" : "<p class=\"kind\">" + kind + "</p>\n", title, verdict_html_, model_html_);
  if (!cards_.empty()) {
    html += "<ul class=\"cards\">\n";
    for (const Card& card : cards_) html += card_html(card);
    html += "</ul>\n";
  }
  html += contents_html(headings_) + body_;
  if (in_section_) html += "</section>\n";
  if (!footer_.empty()) html += "<footer>" + escape_markup(footer_) + "</footer>\n";
  html += "</main>\n";
  if (model_html_.find("class=\"model\"") != std::string::npos)
    html += fmt::format("<script>\n{}</script>\n", model_view_js());
  return html + "</body>\n</html>\n";
}

}  // namespace hm
