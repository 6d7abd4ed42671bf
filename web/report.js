// SPDX-License-Identifier: Apache-2.0
// The report of a session, and of a trainee.
"use strict";
(() => {
  const {el, known, number, words, unit, time, day, table, lineChart, stitchMap, learningCurve, cusumChart, data, section, show, tiles} = catgut;
  const d = data();
  const served = location.protocol.startsWith("http");
  const verdict = (passed) => (passed === true ? ["passed", "good"] : passed === false ? ["not passed", "bad"] : ["not judged", null]);

  function metricRows(metrics) {
    const outside = (m) => (known(m.low) && m.value < m.low) || (known(m.high) && m.value > m.high);
    const band = (m) => (known(m.low) && known(m.high) ? `${number(m.low)} to ${number(m.high)}` : known(m.low) ? `at least ${number(m.low)}` : known(m.high) ? `at most ${number(m.high)}` : "–");
    return table("Metrics of this session", [
      {title: "metric", value: (m) => words(m.name)},
      {title: "value", value: (m) => m.value, cell: (m) => number(m.value) + unit(m.unit), number: true},
      {title: "target", value: band, cell: band, number: true},
      {title: "in the band?", value: (m) => (known(m.low) || known(m.high) ? (outside(m) ? "outside" : "in band") : ""), cell: (m) => !known(m.low) && !known(m.high) ? "" : outside(m) ? el("span", {class: "bad"}, "✗ outside") : el("span", {class: "good"}, "✓ in band")},
      {title: "others' middle half", value: (m) => m.median, cell: (m) => (known(m.q1) ? `${number(m.q1, 3)} to ${number(m.q3, 3)}` : "–"), number: true},
      {title: "percentile", value: (m) => m.rank, cell: (m) => (known(m.rank) && m.others >= 3 ? number(Math.round(m.rank)) : "–"), number: true},
    ], metrics, true);
  }

  // Details come from files: a part that has another shape than expected does not take the rest of the page with it.
  function attempt(draw) {
    try {
      return draw();
    } catch (e) {
      return el("p", {class: "quiet"}, "This part of the session's data has an unknown form and is not shown.");
    }
  }
  // The items of the rubric, as catgut assess scored them.
  function items(score) {
    const stages = score.items.some((i) => i.stage) ? [{title: "stage", value: (i) => i.stage}] : [];
    return table(`Items of the rubric ${score.title || ""}, version ${score.version || ""}`, [...stages,
      {title: "item", value: (i) => i.title || words(i.item)},
      {title: "measured", value: (i) => i.value, cell: (i) => (i.observed === false ? "not observed" : number(i.value, 3) + unit(i.unit)), number: true},
      {title: "points", value: (i) => i.points, cell: (i) => `${number(i.points, 3)} of ${number(i.of, 3)}`, number: true},
      {title: "result", value: (i) => (i.passed ? 1 : 0), cell: (i) => (i.observed === false ? "–" : i.passed ? el("span", {class: "good"}, "✓ passed") : el("span", {class: "bad"}, "✗ not passed"))},
      {title: "band", value: (i) => (i.validated ? "from a study with people" : "not validated")}], score.items, true);
  }

  function tensionChart(t) {
    if (!t || t.time_s.length < 2) return null;
    const points = t.time_s.map((at, i) => [at, (t.peak_n || t.needle_n)[i]]).filter((p) => known(p[0]) && known(p[1]));
    const peak = d3.max(points, (p) => p[1]);
    return lineChart({series: [{name: "tension", points}], levels: peak > 1.5 ? [{y: 3.22, name: "3.22 N: human small bowel begins to tear"}] : [],
      yDomain: [0, Math.max(1, 1.1 * peak, peak > 1.5 ? 3.5 : 0)], xLabel: "time [s]", yLabel: "tension [N]",
      description: `Tension of the thread over ${number(d3.max(points, (p) => p[0]), 3)} seconds, peak ${number(peak, 3)} N`,
      caption: `Largest tension along the thread, ten values per second. Peak ${number(peak, 3)} N. Tear-out of human small bowel 4.62 ± 1.40 N (Gong 2023).`});
  }

  // Pictures around a moment, shown one after the other on request; printed: the moment itself.
  function clip(at) {
    const found = known(at) && (d.clips || []).find((c) => !c.shown && Math.abs(c.at_s - at) < 0.5);
    if (!found) return null;
    found.shown = true;  // under the first of several points of one moment
    const middle = Math.max(0, found.pictures.length - 3);
    const image = el("img", {src: found.pictures[middle], width: 400, height: 260, alt: `The field ${time(found.at_s)} after the start`});
    let timer = null;
    const button = el("button", {type: "button", class: "screen"}, "Play the moment");
    button.addEventListener("click", () => {
      clearInterval(timer);
      let k = 0;
      timer = setInterval(() => {
        image.src = found.pictures[k++];
        if (k === found.pictures.length) clearInterval(timer);
      }, 450);
    });
    return el("figure", {class: "clip"}, image, button);
  }

  function session() {
    const s = d.session, [text, kind] = verdict(s.passed);
    const film = served && s.recording ? el("p", {class: "screen"}, el("a", {href: `/recording/${s.id}`}, "Download the recording"), " · ",
                                            el("a", {href: `/film/${s.id}`}, "Watch the film"), " (when one was made)") : null;
    const replay = (at) => (s.recording ? el("span", {class: "quiet"}, " Replay: ", served ? el("a", {href: `/film/${s.id}#t=${Math.max(0, Math.round(at) - 3)}`}, `film at ${time(at)}`) : el("code", {}, `catgut view ${s.recording}`), ` at ${time(at)}.`) : null);
    const parts = [];
    parts.push(section("Result", tiles([
      ["Score", known(s.score) ? number(s.score) : "not scored", known(s.score_max) ? `of ${number(s.score_max)}` : ""],
      ["Verdict", text, "", kind],
      ["Time", time(s.duration_s), "min:s"],
      ["Attempt", d.task.sessions.findIndex((o) => o.id === s.id) + 1, `of ${d.task.sessions.length}`],
      known(d.task.percentile) && d.task.others >= 3 ? ["Percentile in the cohort", Math.round(d.task.percentile), `newest session, among ${d.task.others} others`] : null]), film));
    if (d.lost.length) {
      const sorted = d.lost.slice().sort((a, b) => Number(b.critical) - Number(a.critical) || b.points - a.points);
      parts.push(section("What to improve", el("ol", {class: "lost"}, sorted.map((l) => el("li", {},
        el("strong", {}, words(l.item)), l.critical ? el("strong", {class: "bad"}, " (critical error)") : null, `: ${l.reason}`,
        l.place && !l.reason.startsWith(l.place) ? ` (${l.place})` : "", ` – ${number(l.points)} points.`, known(l.at_s) ? replay(l.at_s) || el("span", {class: "quiet"}, ` At ${time(l.at_s)}.`) : null, attempt(() => clip(l.at_s)))))));
    } else if (known(s.score)) parts.push(section("What to improve", el("p", {}, "No points were lost.")));
    const map = attempt(() => stitchMap(d.details.bites || [], d.details.lines));
    if (map) parts.push(section("Stitch map", map));
    const tension = attempt(() => tensionChart(d.details.tension));
    if (tension) parts.push(section("Tension of the thread", tension));
    const rubric = attempt(() => {
      const score = (d.details.scores || [])[0];
      return score && score.items.length ? items(score) : null;
    });
    if (rubric) parts.push(section("Scorecard", rubric, el("p", {class: "quiet"}, "Not validated: no study with people supports the limits of this item.")));
    if (d.metrics.length) parts.push(section("Metrics", metricRows(d.metrics), el("p", {class: "quiet"}, "Percentile: share of the other trainees' newest sessions with a smaller value; shown from three others on.")));
    const curve = learningCurve(d.task), sum = cusumChart(d.task.cusum, words(s.task));
    if (curve) parts.push(section("Learning curve", curve));
    if (sum) parts.push(section("Proficiency (CUSUM)", sum));
    if (d.events.length) parts.push(section("Events", el("details", {}, el("summary", {}, `${d.events.length} event${d.events.length === 1 ? "" : "s"}`), table("Events", [
      {title: "time", value: (e) => e.at_s, cell: (e) => time(e.at_s)}, {title: "event", value: (e) => words(e.kind)}, {title: "remark", value: (e) => words(e.text)}], d.events))));
    parts.push(section("About this session", el("p", {class: "quiet"}, [s.rubric ? `Rubric: ${s.rubric}. ` : "No rubric. ", `Program: ${s.program || "unknown"}. `, s.station ? `Station: ${s.station}. ` : "", s.settings ? `Settings: ${s.settings}. ` : "", `Session ${s.id}.`]),
      el("div", {class: "sign"}, el("p", {}, "Remarks of the assessor: ______________________________________________"), el("p", {}, "Signature: ____________________   Date: ____________"))));
    show([el("p", {class: "quiet"}, "Catgut · report of a session"), el("h1", {}, `${words(s.task)}: ${d.person.pseudonym}`),
          el("p", {class: "quiet"}, day(s.started), d.person.cohort ? ` · ${d.person.cohort}` : "", d.person.level ? ` · ${d.person.level}` : ""),
          served ? el("nav", {class: "screen", "aria-label": "Pages"}, el("ul", {}, el("li", {}, el("a", {href: "/"}, "Overview")), el("li", {}, el("a", {href: `/trainee/${d.person.pseudonym}`}, "All sessions of this trainee")))) : null], parts);
  }

  function trainee() {
    const p = d.person, parts = [];
    const all = d.tasks.flatMap((t) => t.sessions);
    parts.push(section("Summary", tiles([["Sessions", all.length], ["Tasks", d.tasks.length],
      ["Training time", number(Math.round(d3.sum(all, (s) => s.duration_s) / 60)), "min"],
      ["Passed", all.filter((s) => s.passed === true).length, `of ${all.filter((s) => s.passed !== null).length} judged`]])));
    if (d.assignments.length) parts.push(section("Assigned tasks", table("Assigned tasks", [
      {title: "task", value: (a) => words(a.task)}, {title: "goal", value: (a) => a.goal, cell: (a) => (known(a.goal) ? `${number(a.goal)} points` : "any score")},
      {title: "done", value: (a) => a.done, cell: (a) => `${Math.min(a.done, a.runs)} of ${a.runs}`, number: true}, {title: "due", value: (a) => a.due || "–"}], d.assignments)));
    if (d.losses.length) parts.push(section("Most frequent lost points", table("Items in which points were lost", [
      {title: "item", value: (l) => words(l.item), cell: (l) => [words(l.item), l.critical ? " (critical)" : ""].join("")}, {title: "sessions", value: (l) => l.sessions, number: true}], d.losses.slice(0, 8))));
    for (const t of d.tasks) {
      const curve = learningCurve(t), sum = cusumChart(t.cusum, words(t.task));
      parts.push(section(words(t.task), known(t.percentile) && t.others >= 3 ? el("p", {}, `Newest score: percentile ${Math.round(t.percentile)} among ${t.others} others.`) : null, curve, sum,
        el("details", {open: t.sessions.length <= 20}, el("summary", {}, `${t.sessions.length} sessions`), table(`Sessions of ${words(t.task)}`, [
          {title: "start", value: (s) => s.started, cell: (s) => (served ? el("a", {href: `/session/${s.id}`}, day(s.started)) : day(s.started))},
          {title: "time", value: (s) => s.duration_s, cell: (s) => time(s.duration_s), number: true},
          {title: "score", value: (s) => s.score, number: true}, {title: "verdict", value: (s) => verdict(s.passed)[0]}], t.sessions, true))));
    }
    if (!d.tasks.length) parts.push(section("Sessions", el("p", {}, "No sessions yet.")));
    show([el("p", {class: "quiet"}, "Catgut · report of a trainee"), el("h1", {}, p.pseudonym), el("p", {class: "quiet"}, [p.cohort, p.level].filter(Boolean).join(" · ")),
          served ? el("nav", {class: "screen", "aria-label": "Pages"}, el("ul", {}, el("li", {}, el("a", {href: "/"}, "Overview")))) : null], parts);
  }

  if (d.kind === "session") session();
  else trainee();
})();
