// SPDX-License-Identifier: Apache-2.0
// The educator's page: cohorts, progress, learning curves, comparison of groups, assignments, export.
"use strict";
(() => {
  const {el, known, number, words, time, day, table, asTable, lineChart, boxChart, data, section, show, tiles} = catgut;
  const d = data();
  const people = new Map(d.people.map((p) => [p.pseudonym, p]));
  const c = d.sessions;
  const sessions = c.id.map((id, i) => ({id, trainee: c.trainee[i], task: c.task[i], started: c.started[i], duration: c.duration_s[i], score: c.score[i], passed: c.passed[i], person: people.get(c.trainee[i]) || {cohort: "", level: ""}}));
  const state = {cohort: "", task: d.tasks[0] || "", from: "", before: "", search: "", by: "cohort", metric: ""};
  const cache = new Map();

  const option = (value, text, chosen) => el("option", {value, selected: value === chosen}, text);
  const pick = (id, label, list, change) => el("div", {}, el("label", {for: id}, label), el("select", {id, onchange: (e) => change(e.target.value)}, list));
  const input = (id, label, type, change) => el("div", {}, el("label", {for: id}, label), el("input", {id, type, onchange: (e) => change(e.target.value), oninput: type === "search" ? (e) => change(e.target.value) : null}));
  const set = (key) => (value) => { state[key] = value; draw(); };

  const filters = el("form", {class: "row", onsubmit: (e) => e.preventDefault()},
    pick("cohort", "Cohort", [option("", "all")].concat(d.cohorts.map((n) => option(n, n))), set("cohort")),
    pick("task", "Task", d.tasks.map((t) => option(t, words(t), state.task)).concat(option("", "all tasks")), set("task")),
    input("from", "From", "date", set("from")), input("before", "Before", "date", set("before")),
    input("search", "Trainee", "search", set("search")));
  const body = el("div", {id: "body"});

  const chosen = (ignoreTask) => sessions.filter((s) => (!state.cohort || s.person.cohort === state.cohort) && (ignoreTask || !state.task || s.task === state.task) &&
    (!state.from || s.started >= state.from) && (!state.before || s.started < state.before) && (!state.search || s.trainee.toLowerCase().includes(state.search.toLowerCase())));
  const byTrainee = (list) => d3.nest ? d3.nest().key((s) => s.trainee).entries(list).map((e) => [e.key, e.values]) : [...d3.group(list, (s) => s.trainee)];
  const quantile = (values, p) => d3.quantile(values.slice().sort(d3.ascending), p);

  // A line of the scores of one trainee, as wide as a word.
  function spark(scores) {
    const w = 90, h = 22;
    const x = d3.scaleLinear([0, Math.max(1, scores.length - 1)], [2, w - 2]), y = d3.scaleLinear(d3.extent(scores), [h - 3, 3]);
    const svg = d3.create("svg").attr("viewBox", `0 0 ${w} ${h}`).attr("width", w).attr("height", h).attr("role", "img").attr("aria-label", `from ${number(scores[0])} to ${number(scores[scores.length - 1])}`);
    svg.append("path").attr("fill", "none").attr("stroke", "#00558c").attr("stroke-width", 1.5).attr("d", d3.line().x((v, i) => x(i)).y(y)(scores));
    return svg.node();
  }

  function progress(list) {
    const rows = byTrainee(list).map(([name, own]) => {
      const scores = own.map((s) => s.score).filter(known);
      return {name, person: own[0].person, n: own.length, first: scores[0], last: scores[scores.length - 1], best: d3.max(scores), passed: own.filter((s) => s.passed === true).length, scores, when: own[own.length - 1].started};
    });
    return table("Progress of trainees", [
      {title: "trainee", value: (r) => r.name, cell: (r) => el("a", {href: `/trainee/${encodeURIComponent(r.name)}`}, r.name)},
      {title: "cohort", value: (r) => r.person.cohort}, {title: "level", value: (r) => r.person.level},
      {title: "sessions", value: (r) => r.n, number: true}, {title: "first", value: (r) => r.first, number: true}, {title: "last", value: (r) => r.last, number: true},
      {title: "best", value: (r) => r.best, number: true}, {title: "passed", value: (r) => r.passed, number: true},
      {title: "scores", value: (r) => (r.last || 0) - (r.first || 0), cell: (r) => (r.scores.length > 1 ? spark(r.scores) : "–")},
      {title: "newest", day: true, value: (r) => r.when, cell: (r) => r.when.slice(0, 10)}], rows, true);
  }

  function curves(list) {
    const all = byTrainee(list).map(([name, own]) => ({name, points: own.map((s, i) => [i + 1, s.score]).filter((p) => known(p[1]))}));
    const attempts = d3.max(all, (t) => d3.max(t.points, (p) => p[0])) || 0;
    const band = [], median = [];
    for (let n = 1; n <= attempts; ++n) {
      const values = all.flatMap((t) => t.points.filter((p) => p[0] === n).map((p) => p[1]));
      if (values.length < 3) continue;
      band.push([n, quantile(values, 0.25), quantile(values, 0.75)]);
      median.push([n, quantile(values, 0.5)]);
    }
    if (!attempts) return el("p", {}, "No scored sessions.");
    return lineChart({series: all.map((t) => ({name: t.name, points: t.points, quiet: true})).concat([{name: "median", points: median, dots: true}]), bands: [{points: band}],
      xLabel: "attempt", yLabel: "score [points]", xFormat: (v) => (Number.isInteger(v) ? v : ""),
      description: `Learning curves of ${all.length} trainees over ${attempts} attempts; median ${number(median.length ? median[0][1] : NaN)} at first, ${number(median.length ? median[median.length - 1][1] : NaN)} at last`,
      caption: "Gray: each trainee. Blue: median and middle half, from three trainees on.",
      numbers: asTable("Median and quartiles by attempt", ["attempt", "first quartile", "median", "third quartile"], median.map((m, i) => [m[0], band[i][1], m[1], band[i][2]]))});
  }

  const boxOf = (values) => {
    const v = values.slice().sort(d3.ascending), q1 = d3.quantile(v, 0.25), q3 = d3.quantile(v, 0.75), reach = 1.5 * (q3 - q1);
    const inside = v.filter((x) => x >= q1 - reach && x <= q3 + reach);
    return {n: v.length, low: inside[0], q1, median: d3.quantile(v, 0.5), q3, high: inside[inside.length - 1], outliers: v.filter((x) => x < q1 - reach || x > q3 + reach)};
  };

  // Of each trainee's newest session, so that a diligent trainee does not count more.
  function comparison(list) {
    const place = el("div", {});
    const plot = (valueOf, label) => {
      const groups = new Map();
      for (const [, own] of byTrainee(list)) {
        const s = own[own.length - 1], v = valueOf(s), g = s.person[state.by] || "none";
        if (known(v)) groups.set(g, (groups.get(g) || []).concat(v));
      }
      const rows = [...groups].sort((a, b) => (a[0] < b[0] ? -1 : 1)).map(([g, values]) => ({label: g, group: g, ...boxOf(values)}));
      place.replaceChildren(rows.length ? boxChart({rows, xLabel: label, description: `${label} by ${state.by}, newest session of each trainee`,
        caption: `${label} by ${state.by}: newest session of each trainee. Box: middle half; bar: median; whiskers: last value within 1.5 box lengths; marks: outliers.`}) : el("p", {}, "No values."));
    };
    const metric = d.metrics.find((m) => m.name === state.metric);
    if (!metric) plot((s) => s.score, "score [points]");
    else if (cache.has(metric.name)) plot((s) => cache.get(metric.name).get(s.id), words(metric.name) + (metric.unit && metric.unit !== "1" ? ` [${metric.unit}]` : ""));
    else {
      place.append(el("p", {role: "status"}, "Loading."));
      fetch(`/api/metric?name=${encodeURIComponent(metric.name)}`).then((r) => (r.ok ? r.json() : Promise.reject(new Error(r.status)))).then((m) => {
        cache.set(metric.name, new Map(m.id.map((id, i) => [id, m.value[i]])));
        draw();
      }).catch((e) => place.replaceChildren(el("p", {class: "bad", role: "alert"}, `The metric could not be loaded (${e.message}).`)));
    }
    return [el("form", {class: "row", onsubmit: (e) => e.preventDefault()},
      pick("by", "Groups", [option("cohort", "cohort", state.by), option("level", "level", state.by)], set("by")),
      pick("metric", "Value", [option("", "score", state.metric)].concat(d.metrics.map((m) => option(m.name, words(m.name), state.metric))), set("metric"))), place];
  }

  function assignments() {
    const token = el("input", {type: "hidden", name: "token", value: d.token});
    const list = d.assignments.length ? table("Assigned tasks", [
      {title: "cohort", value: (a) => a.cohort}, {title: "task", value: (a) => words(a.task)},
      {title: "goal", value: (a) => a.goal, cell: (a) => `${a.runs} × ` + (known(a.goal) ? `${number(a.goal)} points` : "any score")}, {title: "due", value: (a) => a.due || "–"},
      {title: "finished", value: (a) => a.finished, cell: (a) => `${a.finished} of ${a.members}`, number: true},
      {title: "behind", value: (a) => a.behind.length, cell: (a) => (a.behind.length ? el("details", {}, el("summary", {}, `${a.behind.length} trainees`), el("ul", {}, a.behind.map((b) => el("li", {}, el("a", {href: `/trainee/${encodeURIComponent(b.trainee)}`}, b.trainee), ` (${b.done} of ${a.runs})`)))) : "–")},
      {title: "change", value: () => "", cell: (a) => el("form", {method: "post", action: "/assignment/remove", class: "screen"}, token.cloneNode(), el("input", {type: "hidden", name: "id", value: a.id}), el("button", {class: "plain", type: "submit", "aria-label": `Remove ${words(a.task)} of ${a.cohort}`}, "remove"))}], d.assignments)
      : el("p", {}, "No tasks are assigned.");
    const field = (id, label, more) => el("div", {}, el("label", {for: id}, label), el("input", {id, ...more}));
    const add = el("form", {class: "row screen", method: "post", action: "/assignment"}, token.cloneNode(),
      field("a-cohort", "Cohort", {name: "cohort", required: true, maxlength: 64, list: "cohorts"}), field("a-task", "Task", {name: "task", required: true, maxlength: 64, pattern: "[A-Za-z0-9._\\-]+", list: "tasks"}),
      field("a-goal", "Goal [points]", {name: "goal", type: "number", step: "any", min: 0}), field("a-runs", "Runs", {name: "runs", type: "number", min: 1, max: 1000, value: 1, required: true}),
      field("a-due", "Due", {name: "due", type: "date"}), el("datalist", {id: "cohorts"}, d.cohorts.map((n) => el("option", {value: n}))), el("datalist", {id: "tasks"}, d.tasks.map((n) => el("option", {value: n}))),
      el("button", {class: "main", type: "submit"}, "Assign"));
    return [list, el("h3", {class: "screen"}, "Assign a task"), add];
  }

  function exports() {
    const query = new URLSearchParams(Object.entries({cohort: state.cohort, task: state.task, from: state.from, before: state.before}).filter(([, v]) => v)).toString();
    const link = (kind, text) => el("li", {}, el("a", {href: `/export.${kind}?${query}`, download: true}, text));
    return el("ul", {}, link("csv", "CSV: one row per session, all metrics"), link("json", "JSON: sessions with events and reasons"), link("xapi", "xAPI statements for a learning record store"));
  }

  function draw() {
    const focused = document.activeElement && document.activeElement.id;
    const list = chosen(false);
    const scores = list.map((s) => s.score).filter(known);
    const newest = list.slice(-12).reverse();
    body.replaceChildren(
      section("Summary", tiles([["Trainees", new Set(list.map((s) => s.trainee)).size], ["Sessions", list.length], ["Hours", number(d3.sum(list, (s) => s.duration) / 3600, 3)],
        ["Median score", scores.length ? number(quantile(scores, 0.5)) : "–"], ["Passed", list.filter((s) => s.passed === true).length, `of ${list.filter((s) => s.passed !== null).length} judged`]])),
      section("Learning curves", state.task ? curves(list) : el("p", {}, "Choose a task.")),
      section("Comparison of groups", state.task ? comparison(list) : el("p", {}, "Choose a task.")),
      section("Assigned tasks", assignments()),
      section("Progress", list.length ? progress(list) : el("p", {}, "No sessions match.")),
      section("Newest sessions", table("Newest sessions", [{title: "start", value: (s) => s.started, cell: (s) => el("a", {href: `/session/${s.id}`}, day(s.started))}, {title: "trainee", value: (s) => s.trainee},
        {title: "task", value: (s) => words(s.task)}, {title: "time", value: (s) => s.duration, cell: (s) => time(s.duration), number: true}, {title: "score", value: (s) => s.score, number: true},
        {title: "verdict", value: (s) => (s.passed === null ? "not judged" : s.passed ? "passed" : "not passed")}], newest, true)),
      section("Export", exports()),
      section("Surveys", el("ul", {}, d.questionnaires.map((n) => el("li", {}, el("a", {href: `/survey/${n}/results`}, `${words(n)}: results`), " · ", el("a", {href: `/survey/${n}`}, "form"))))));
    if (focused) { const again = document.getElementById(focused); if (again) again.focus(); }
  }

  draw();
  show([el("h1", {}, "Training overview"), el("p", {class: "quiet"}, `${d.people.length} people, ${sessions.length} sessions`, d.who ? ` · signed in as ${d.who}` : ""),
        d.who ? el("form", {method: "post", action: "/logout", class: "screen"}, el("input", {type: "hidden", name: "token", value: d.token}), el("button", {class: "plain", type: "submit"}, "Sign out")) : null],
       [el("section", {class: "screen", "aria-label": "Filters"}, el("h2", {}, "Filters"), filters), body]);
  document.documentElement.dataset.ready = "yes";
})();
