#include "hm/report/html_report.hpp"

#include <fmt/format.h>

#include <string_view>

#include "hm/core/check.hpp"
#include "hm/report/plot.hpp"

namespace hm {
namespace {

constexpr std::string_view kCss =
    ":root{color-scheme:light dark;--ink:#20252e;--soft:#5b6472;--page:#f5f6f8;--card:#fff;--edge:#dde1e7;"
    "--good:#18855a;--doubtful:#b07400;--bad:#c2303c}"
    "@media(prefers-color-scheme:dark){:root{--ink:#e3e7ee;--soft:#9aa4b2;--page:#14171c;--card:#1d2128;--"
    "edge:#323843;"
    "--good:#52c795;--doubtful:#e8b04a;--bad:#ff7b83}}"
    "*{box-sizing:border-box}body{margin:0;background:var(--page);color:var(--ink);"
    "font:16px/1.55 system-ui,-apple-system,'Segoe UI',Roboto,sans-serif}"
    "main{max-width:1120px;margin:0 auto;padding:1.2rem}"
    "h1{font-size:1.7rem;line-height:1.2;margin:.4rem 0}h2{font-size:1.25rem;margin:2.2rem 0 .6rem}"
    ".verdict{border-left:5px solid var(--soft);background:var(--card);border-radius:6px;padding:.8rem 1rem;"
    "font-size:1.08rem;margin:.8rem 0 1.2rem}"
    ".good{border-color:var(--good)}.doubtful{border-color:var(--doubtful)}.bad{border-color:var(--bad)}"
    ".cards{display:grid;grid-template-columns:repeat(auto-fit,minmax(150px,1fr));gap:.7rem;margin:0;padding:"
    "0;"
    "list-style:none}"
    ".cards li{background:var(--card);border:1px solid var(--edge);border-radius:8px;padding:.7rem .9rem}"
    ".name{color:var(--soft);font-size:.85rem}.value{font-size:1.6rem;font-weight:650;line-height:1.25}"
    ".unit{font-size:.95rem;font-weight:400;color:var(--soft)}.note{color:var(--soft);font-size:.82rem}"
    "figure{margin:1rem 0;background:var(--card);border:1px solid "
    "var(--edge);border-radius:8px;padding:.6rem;"
    "overflow-x:auto}"
    "figure img,figure>svg{display:block;width:100%;height:auto;margin:0 auto;border-radius:4px}"
    "figcaption{color:var(--soft);font-size:.9rem;padding:.45rem .2rem 0}"
    ".scroll{overflow-x:auto}table{border-collapse:collapse;width:100%;background:var(--card);font-size:."
    "93rem;"
    "font-variant-numeric:tabular-nums}"
    "th,td{text-align:left;padding:.4rem .6rem;border-bottom:1px solid "
    "var(--edge)}th{color:var(--soft);font-weight:600}"
    "details{background:var(--card);border:1px solid var(--edge);border-radius:8px;padding:.6rem "
    ".9rem;margin:.8rem 0}"
    "summary{cursor:pointer;font-weight:600}pre{overflow-x:auto;font-size:.83rem;line-height:1.4}"
    "footer{color:var(--soft);font-size:.85rem;margin:2.5rem 0 1rem}";

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

std::string figure_html(const std::string& content, const std::string& caption) {
  const std::string text =
      caption.empty() ? std::string() : "<figcaption>" + escape_markup(caption) + "</figcaption>";
  return "<figure>" + content + text + "</figure>\n";
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
  body_ += fmt::format("<section>\n<h2>{}</h2>\n", escape_markup(heading));
  if (!introduction.empty()) add_paragraph(std::move(introduction));
}

void HtmlReport::add_figure(std::span<const std::uint8_t> file_bytes, std::string alt, std::string caption) {
  HM_CHECK(!file_bytes.empty(), "{}", alt);
  body_ += figure_html(fmt::format("<img src=\"data:{};base64,{}\" alt=\"{}\">", media_type(file_bytes),
                                   base64(file_bytes), escape_markup(alt)),
                       caption);
}

void HtmlReport::add_svg(std::string svg, std::string caption) { body_ += figure_html(svg, caption); }

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
  std::string html = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" "
      "content=\"width=device-width, "
      "initial-scale=1\">\n<title>{0}</title>\n<style>{1}</style>\n</head>\n<body>\n"
      "<main>\n<h1>{0}</h1>\n{2}",
      escape_markup(title_), kCss, verdict_html_);
  if (!cards_.empty()) {
    html += "<ul class=\"cards\">\n";
    for (const Card& card : cards_) html += card_html(card);
    html += "</ul>\n";
  }
  html += body_;
  if (in_section_) html += "</section>\n";
  if (!footer_.empty()) html += "<footer>" + escape_markup(footer_) + "</footer>\n";
  return html + "</main>\n</body>\n</html>\n";
}

}  // namespace hm
