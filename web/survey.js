// SPDX-License-Identifier: Apache-2.0
// Results of a survey, its form, and the login form.
"use strict";
(() => {
  const {el, known, number, table, boxChart, data, section, show, tiles} = catgut;
  const d = data();
  const served = location.protocol.startsWith("http");
  const back = served ? el("nav", {class: "screen", "aria-label": "Pages"}, el("ul", {}, el("li", {}, el("a", {href: "/"}, "Overview")))) : null;

  function results() {
    const rows = d.rows.filter((r) => r.n > 0), all = rows.filter((r) => !r.group), groups = rows.filter((r) => r.group);
    const text = Object.fromEntries(d.questions.map((q) => [q.key, q.text]));
    const chart = (list, caption) => boxChart({rows: list.map((r) => ({...r, label: r.group ? `${r.key} ${r.group}` : r.key})), domain: [d.low - 0.3, d.high + 0.3], ticks: d.high - d.low,
      xLabel: `rating (${d.low} ${d.labels[d.low] || ""} to ${d.high} ${d.labels[d.high] || ""})`, description: caption, caption: caption + ". Box: middle half; bar: median; whiskers: last rating within 1.5 box lengths; marks: outliers."});
    const share = (r) => `${r.favorable} (${Math.round((100 * r.favorable) / r.n)} %)`;
    const parts = [section("Respondents", tiles([["Respondents", d.respondents], ["Questions", d.questions.length]]))];
    if (!all.length) parts.push(section("Ratings", el("p", {}, "No answers yet.")));
    else {
      parts.push(section("Ratings", chart(all, "Ratings of all respondents"), table("Ratings", [
        {title: "question", value: (r) => r.key}, {title: "text", value: (r) => text[r.key]}, {title: "n", value: (r) => r.n, number: true}, {title: "median", value: (r) => r.median, number: true},
        {title: "quartiles", value: (r) => r.q1, cell: (r) => `${number(r.q1)} to ${number(r.q3)}`, number: true},
        {title: `rated ${d.favorable} or more`, value: (r) => r.favorable / r.n, cell: share, number: true}], all)));
      if (groups.length) {
        const order = d.questions.flatMap((q) => groups.filter((r) => r.key === q.key));
        parts.push(section("By group", chart(order, "Ratings by group"), table("Ratings by group", [
          {title: "question", value: (r) => r.key}, {title: "group", value: (r) => r.group}, {title: "n", value: (r) => r.n, number: true}, {title: "median", value: (r) => r.median, number: true},
          {title: `rated ${d.favorable} or more`, value: (r) => r.favorable / r.n, cell: share, number: true}], order),
          el("ul", {class: "quiet"}, Object.entries(d.p).filter(([, p]) => known(p)).map(([key, p]) => el("li", {}, `${key}: difference of the first two groups p ${p < 0.001 ? "< 0.001" : "= " + p.toFixed(3)} (exact Mann-Whitney test)`)))));
      }
    }
    for (const [key, list] of Object.entries(d.text)) parts.push(section(text[key] || key, el("ul", {}, list.map((t) => el("li", {}, t)))));
    show([el("p", {class: "quiet"}, "Catgut · results of a survey"), el("h1", {}, d.title), el("p", {class: "quiet"}, d.source), back], parts);
  }

  function form() {
    const points = d3.range(d.low, d.high + 1);
    const questions = d.questions.map((q) => el("fieldset", {}, el("legend", {}, q.text), q.free
      ? el("label", {}, "Answer", el("textarea", {name: "q." + q.key, rows: 4, cols: 60, maxlength: 4000}))
      : el("div", {class: "scale"}, points.map((v) => el("label", {}, el("input", {type: "radio", name: "q." + q.key, value: v, required: true}), v + (d.labels[v] ? " " + d.labels[v] : ""))))));
    show([el("h1", {}, d.title), el("p", {}, d.intro)], [section("Questions", el("form", {method: "post", action: `/survey/${d.name}`},
      el("input", {type: "hidden", name: "token", value: d.token}),
      el("div", {class: "row"}, el("label", {}, "Pseudonym or number", el("input", {name: "respondent", required: true, maxlength: 64, value: d.respondent || ""}))),
      d.groups.length ? el("div", {}, el("label", {}, "Group", el("select", {name: "group"}, d.groups.map((g) => el("option", {value: g}, g))))) : null,
      questions, el("button", {class: "main", type: "submit"}, "Send")))]);
  }

  function login() {
    show([el("h1", {}, "Sign in")], [section("Sign in", d.fault ? el("p", {class: "bad", role: "alert"}, d.fault) : null, el("form", {method: "post", action: "/login"},
      el("p", {}, el("label", {}, "Pseudonym", el("br"), el("input", {name: "name", required: true, autocomplete: "username"}))),
      el("p", {}, el("label", {}, "Password", el("br"), el("input", {name: "password", type: "password", required: true, autocomplete: "current-password"}))),
      el("button", {class: "main", type: "submit"}, "Sign in")))]);
  }

  function message() {
    show([el("h1", {}, d.title), back], [section(d.title, el("p", {}, d.text))]);
  }

  ({survey: results, form, login, message})[d.kind]();
})();
