// SPDX-License-Identifier: Apache-2.0
// report: HTML pages; see data.h. The data of a page is text inside a script element of type application/json: "<" is written
// as an escape of JSON there, so that no text of the database can end the element. The scripts show texts as text nodes.
#include <fmt/format.h>

#include "report/assets.h"
#include "report/data.h"

namespace catgut {

std::string html_escape(const std::string& text) {
  std::string out;
  for (char c : text) {
    if (c == '&') out += "&amp;";
    else if (c == '<') out += "&lt;";
    else if (c == '>') out += "&gt;";
    else if (c == '"') out += "&quot;";
    else if (c == '\'') out += "&#39;";
    else out += c;
  }
  return out;
}

std::string html_page(const std::string& kind, const std::string& title, const std::string& data, const std::string& nonce) {
  std::string json;
  for (char c : data) json += c == '<' ? std::string("\\u003c") : std::string(1, c);
  const std::string mark = nonce.empty() ? "" : fmt::format(" nonce=\"{}\"", nonce);
  std::string out = "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n";
  out += "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n";
  if (nonce.empty())
    out +=
        "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'; "
        "script-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'\">\n";
  out += fmt::format("<title>{}</title>\n<style{}>\n", html_escape(title), mark);
  out += assets::style();
  out += fmt::format(
      "</style>\n</head>\n<body class=\"{0}\">\n<a class=\"skip\" href=\"#page\">Skip to the content</a>\n"
      "<noscript><p>This page draws its tables and charts with JavaScript, which is switched off. The data is in the "
      "source of this page as JSON.</p></noscript>\n<div id=\"root\"></div>\n"
      "<script type=\"application/json\" id=\"data\"{1}>",
      kind, mark);
  out += json;
  out += "</script>\n<!-- Charts by D3, Copyright 2010-2022 Mike Bostock, BSD-3-Clause license: d3js.org -->\n";
  for (std::string_view script : {assets::d3(), assets::charts(),
                                  kind == "educator"                                      ? assets::educator()
                                  : kind == "survey" || kind == "form" || kind == "login" ? assets::survey()
                                                                                          : assets::report()}) {
    out += fmt::format("<script{}>\n", mark);
    out += script;
    out += "</script>\n";
  }
  return out + "</body>\n</html>\n";
}

}  // namespace catgut
