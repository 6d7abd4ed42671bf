// SPDX-License-Identifier: Apache-2.0
// Charts of reports and of the educator's page, drawn with D3 as SVG. Every chart has a text alternative and its numbers as a
// table. Series differ in shape and dash as well as in color (Okabe and Ito's palette, darkened for contrast).
"use strict";
const catgut = (() => {
  const colors = ["#00558c", "#a04700", "#00664b", "#8a3b74", "#5b5b00", "#333333"];
  const dashes = ["", "6 3", "2 3", "8 3 2 3", "1 4", "12 4"];
  const marks = [d3.symbolCircle, d3.symbolSquare, d3.symbolTriangle, d3.symbolDiamond, d3.symbolCross, d3.symbolStar];

  // An element; texts become text nodes, never markup.
  function el(name, attributes, ...children) {
    const node = document.createElement(name);
    for (const [key, value] of Object.entries(attributes || {})) {
      if (key.startsWith("on")) node.addEventListener(key.slice(2), value);
      else if (value === true) node.setAttribute(key, "");
      else if (value !== false && value !== null && value !== undefined) node.setAttribute(key, value);
    }
    for (const child of children.flat(Infinity)) if (child !== null && child !== undefined) node.append(child);
    return node;
  }
  const known = (v) => v !== null && v !== undefined && Number.isFinite(v);
  function number(v, digits = 4) {
    if (!known(v)) return "–";
    if (Number.isInteger(v) && Math.abs(v) < 1e7) return String(v);
    return String(Number(v.toPrecision(digits)));
  }
  const words = (name) => (name || "").replace(/_/g, " ");
  const unit = (u) => (u && u !== "1" ? " " + u : "");
  function time(seconds) {
    if (!known(seconds)) return "–";
    const s = Math.round(seconds);
    return Math.floor(s / 60) + ":" + String(s % 60).padStart(2, "0");
  }
  const day = (text) => (text || "").replace("T", " ").replace("Z", " UTC");

  // columns: [{title, value(row), cell(row)?, number?}]. sortable: buttons in the heading.
  function table(caption, columns, rows, sortable) {
    const wide = columns.length > 3;  // on a phone every row is a block of its own, with the titles beside the values; see style.css
    const role = (name) => (wide ? name : null);  // such a block is no table for a screen reader, so that the roles are stated
    const body = el("tbody", {role: role("rowgroup")});
    const fill = (list) => body.replaceChildren(...list.map((row) => el("tr", {role: role("row")}, columns.map((c, i) => {
      const content = c.cell ? c.cell(row) : c.number ? number(c.value(row)) : c.value(row);
      return i === 0 ? el("th", {scope: "row", role: role("rowheader"), class: c.number ? "number" : null}, content)
                     : el("td", {role: role("cell"), "data-title": c.title, class: c.number ? "number" : c.day ? "day" : null}, content);
    }))));
    const heads = columns.map((c) => {
      const head = el("th", {scope: "col", role: role("columnheader"), class: c.number ? "number" : null});
      if (!sortable) head.append(c.title);
      else head.append(el("button", {type: "button", onclick: () => {
        const up = head.getAttribute("aria-sort") !== "ascending";
        for (const other of heads) other.removeAttribute("aria-sort");
        head.setAttribute("aria-sort", up ? "ascending" : "descending");
        const sorted = rows.slice().sort((a, b) => {
          const x = c.value(a), y = c.value(b);
          if (x === null || x === undefined) return 1;
          if (y === null || y === undefined) return -1;
          return (x < y ? -1 : x > y ? 1 : 0) * (up ? 1 : -1);
        });
        fill(sorted);
      }}, c.title));
      return head;
    });
    fill(rows);
    return el("div", {class: "scroll", tabindex: "0", role: "region", "aria-label": "table: " + caption},
              el("table", {class: wide ? "wide" : null, role: role("table")}, el("caption", {}, caption), el("thead", {role: role("rowgroup")}, el("tr", {role: role("row")}, heads)), body));
  }

  function asTable(caption, heads, rows) {
    return el("details", {}, el("summary", {}, "The numbers as a table"),
              table(caption, heads.map((title, i) => ({title, value: (r) => r[i], number: i > 0 || rows.every((r) => typeof r[0] === "number")})), rows));
  }

  // Units of a drawing, scaled to the width of the page: fewer on a phone, so that texts stay readable.
  const width = matchMedia("(max-width: 40rem)").matches ? 480 : 720, margin = {top: 14, right: 18, bottom: 44, left: 60};
  function frame(label, height) {
    const svg = d3.create("svg").attr("viewBox", `0 0 ${width} ${height}`).attr("role", "img").attr("aria-label", label);
    return svg;
  }
  function axes(svg, height, x, y, xLabel, yLabel, xFormat) {
    const bottom = d3.axisBottom(x).ticks(8), left = d3.axisLeft(y).ticks(6);
    if (xFormat) bottom.tickFormat(xFormat);
    svg.append("g").attr("class", "grid").attr("transform", `translate(${margin.left},0)`)
       .call(d3.axisLeft(y).ticks(6).tickSize(-(width - margin.left - margin.right)).tickFormat(""));
    svg.append("g").attr("class", "axis").attr("transform", `translate(0,${height - margin.bottom})`).call(bottom);
    svg.append("g").attr("class", "axis").attr("transform", `translate(${margin.left},0)`).call(left);
    svg.append("text").attr("x", (width + margin.left) / 2).attr("y", height - 6).attr("text-anchor", "middle").text(xLabel);
    svg.append("text").attr("transform", `translate(15,${(height - margin.bottom) / 2}) rotate(-90)`).attr("text-anchor", "middle").text(yLabel);
  }
  function figure(svg, caption, numbers) {
    return el("figure", {}, svg.node(), el("figcaption", {}, caption), numbers);
  }
  const wide = (extent, share) => {
    let [low, high] = extent;
    if (!known(low)) [low, high] = [0, 1];
    const more = (high - low || Math.abs(high) || 1) * share;
    return [low - more, high + more];
  };

  // series: [{name, points: [[x, y]], dots, quiet}]; bands: [{name, points: [[x, low, high]]}]; levels: [{y, name}].
  function lineChart(o) {
    const height = o.height || 300;
    const ys = [], xs = [];
    for (const s of o.series) for (const p of s.points) { xs.push(p[0]); ys.push(p[1]); }
    for (const b of o.bands || []) for (const p of b.points) { xs.push(p[0]); ys.push(p[1], p[2]); }
    for (const l of o.levels || []) ys.push(l.y);
    const x = d3.scaleLinear(o.xDomain || wide(d3.extent(xs), 0.02), [margin.left, width - margin.right]);
    const y = d3.scaleLinear(o.yDomain || wide(d3.extent(ys), 0.06), [height - margin.bottom, margin.top]).nice();
    const svg = frame(o.description, height);
    axes(svg, height, x, y, o.xLabel, o.yLabel, o.xFormat);
    for (const b of o.bands || [])
      svg.append("path").attr("fill", "#d5e6f3").attr("fill-opacity", 0.8)
         .attr("d", d3.area().x((p) => x(p[0])).y0((p) => y(p[1])).y1((p) => y(p[2]))(b.points));
    for (const [i, l] of (o.levels || []).entries()) {
      svg.append("line").attr("x1", margin.left).attr("x2", width - margin.right).attr("y1", y(l.y)).attr("y2", y(l.y))
         .attr("stroke", colors[(i + 1) % colors.length]).attr("stroke-width", 1.5).attr("stroke-dasharray", dashes[i + 1]);
    }
    let shown = 0;
    for (const s of o.series) {
      const i = s.quiet ? 0 : shown++;
      if (!s.dotsOnly)
        svg.append("path").attr("fill", "none").attr("stroke", s.quiet ? "#8b95a1" : colors[i % colors.length])
           .attr("stroke-width", s.quiet ? 0.7 : 2).attr("stroke-opacity", s.quiet ? 0.55 : 1)
           .attr("stroke-dasharray", s.quiet ? null : dashes[i % dashes.length])
           .attr("d", d3.line().x((p) => x(p[0])).y((p) => y(p[1]))(s.points));
      if (s.dots || s.dotsOnly)
        svg.append("g").selectAll("path").data(s.points).join("path").attr("fill", colors[i % colors.length])
           .attr("d", d3.symbol().type(marks[i % marks.length]).size(48)).attr("transform", (p) => `translate(${x(p[0])},${y(p[1])})`)
           .append("title").text((p) => `${s.name}: ${number(p[0])}, ${number(p[1])}`);
    }
    // Above the lines, with a border of paper.
    for (const l of o.levels || [])
      svg.append("text").attr("class", "above").attr("x", width - margin.right).attr("y", y(l.y) - 4).attr("text-anchor", "end").text(l.name);
    const named = o.series.filter((s) => !s.quiet && s.name);
    if (named.length > 1) {
      const key = svg.append("g");
      named.forEach((s, i) => {
        const at = key.append("g").attr("transform", `translate(${margin.left + 12},${margin.top + 6 + 18 * i})`);
        at.append("line").attr("x2", 26).attr("stroke", colors[i]).attr("stroke-width", 2).attr("stroke-dasharray", dashes[i]);
        if (s.dots) at.append("path").attr("fill", colors[i]).attr("d", d3.symbol().type(marks[i]).size(48)).attr("transform", "translate(13,0)");
        at.append("text").attr("x", 32).attr("y", 4).text(s.name);
      });
    }
    return figure(svg, o.caption, o.numbers || null);
  }

  // rows: [{label, n, low, q1, median, q3, high, outliers, group}]. Horizontal boxes, as labels are long.
  function boxChart(o) {
    const step = 30, height = margin.top + margin.bottom + step * Math.max(1, o.rows.length), left = 190;
    const values = o.rows.flatMap((r) => [r.low, r.high, ...(r.outliers || [])]).filter(known);
    const x = d3.scaleLinear(o.domain || wide(d3.extent(values), 0.06), [left, width - margin.right]);
    const svg = frame(o.description, height);
    svg.append("g").attr("class", "grid").attr("transform", `translate(0,${margin.top})`)
       .call(d3.axisTop(x).ticks(o.ticks || 7).tickSize(-(height - margin.top - margin.bottom)).tickFormat(""));
    svg.append("g").attr("class", "axis").attr("transform", `translate(0,${height - margin.bottom})`).call(d3.axisBottom(x).ticks(o.ticks || 7));
    svg.append("text").attr("x", (width + left) / 2).attr("y", height - 6).attr("text-anchor", "middle").text(o.xLabel);
    const groups = [...new Set(o.rows.map((r) => r.group || ""))];
    o.rows.forEach((r, k) => {
      const middle = margin.top + step * (k + 0.5), i = groups.indexOf(r.group || "") % colors.length;
      const g = svg.append("g");
      g.append("title").text(`${r.label}: n ${r.n}, median ${number(r.median)}, quartiles ${number(r.q1)} to ${number(r.q3)}`);
      g.append("text").attr("x", left - 10).attr("y", middle + 4).attr("text-anchor", "end").text(`${r.label} (n ${r.n})`);
      if (!r.n) return;
      const line = (x1, x2, y1, y2, w) => g.append("line").attr("x1", x(x1)).attr("x2", x(x2)).attr("y1", y1).attr("y2", y2)
                                          .attr("stroke", colors[i]).attr("stroke-width", w);
      line(r.low, r.q1, middle, middle, 1.5);
      line(r.q3, r.high, middle, middle, 1.5);
      line(r.low, r.low, middle - 5, middle + 5, 1.5);
      line(r.high, r.high, middle - 5, middle + 5, 1.5);
      g.append("rect").attr("x", x(r.q1)).attr("width", Math.max(1, x(r.q3) - x(r.q1))).attr("y", middle - 9).attr("height", 18)
       .attr("fill", i % 2 ? "#fbe8d8" : "#d5e6f3").attr("stroke", colors[i]).attr("stroke-width", 1.5).attr("stroke-dasharray", dashes[i]);
      line(r.median, r.median, middle - 9, middle + 9, 3.5);
      for (const v of r.outliers || []) g.append("path").attr("d", d3.symbol().type(marks[i]).size(30)).attr("fill", "none")
                                         .attr("stroke", colors[i]).attr("transform", `translate(${x(v)},${middle})`);
    });
    const numbers = asTable(o.description, ["group", "n", "low whisker", "first quartile", "median", "third quartile", "high whisker"],
                            o.rows.map((r) => [r.label, r.n, r.low, r.q1, r.median, r.q3, r.high]));
    return figure(svg, o.caption, numbers);
  }

  // The sutured edge unrolled: position along it, and distance from it. Entries are circles, exits are squares.
  function stitchMap(bites, lines) {
    const placed = bites.filter((b) => b.along_mm && b.edge_mm && known(b.along_mm[0]) && known(b.edge_mm[0]));
    if (!placed.length) return null;
    const walls = [...new Set(placed.map((b) => b.wall || 0))].sort();
    const each = 190, height = each * walls.length + margin.bottom;
    const longest = d3.max(placed, (b) => d3.max(b.along_mm)) || 1;
    const length = Math.max(longest, d3.max(lines || [], (l) => l.length_mm) || 0);
    const deepest = Math.max(8, d3.max(placed, (b) => d3.max(b.edge_mm.filter(known))) * 1.1);
    const x = d3.scaleLinear([0, length], [margin.left, width - margin.right]);
    const svg = frame(`Map of ${placed.length} bites: position along the edge and distance from it`, height);
    walls.forEach((wall, row) => {
      const top = each * row + margin.top, bottom = each * (row + 1) - 20;
      const y = d3.scaleLinear([0, deepest], [top, bottom]);
      svg.append("rect").attr("x", margin.left).attr("width", width - margin.left - margin.right).attr("y", y(3)).attr("height", y(5) - y(3)).attr("fill", "#d5e6f3");
      svg.append("g").attr("class", "axis").attr("transform", `translate(${margin.left},0)`).call(d3.axisLeft(y).ticks(5));
      svg.append("line").attr("x1", margin.left).attr("x2", width - margin.right).attr("y1", y(0)).attr("y2", y(0)).attr("stroke", "#1b1f24").attr("stroke-width", 2);
      svg.append("text").attr("x", margin.left + 6).attr("y", bottom - 2).text(walls.length > 1 ? `wall ${wall + 1}` : "");
      svg.append("text").attr("transform", `translate(15,${(top + bottom) / 2}) rotate(-90)`).attr("text-anchor", "middle").text("from the edge [mm]");
      placed.forEach((b, n) => {
        if ((b.wall || 0) !== wall) return;
        const g = svg.append("g");
        const [a0, a1] = b.along_mm, [e0, e1] = b.edge_mm.map((e) => (known(e) ? e : 0));
        g.append("title").text(`bite ${n + 1}: in ${number(e0, 3)} mm, out ${number(e1, 3)} mm from the edge, ${number(b.spacing_mm, 3)} mm after the one before`);
        // A bite across the start of a closed edge is drawn in two parts by its ends only.
        if (known(a1) && Math.abs(a1 - a0) < length / 2)
          g.append("line").attr("x1", x(a0)).attr("y1", y(e0)).attr("x2", x(a1)).attr("y2", y(e1)).attr("stroke", "#4d5661").attr("stroke-width", 2);
        const good = (e) => e >= 3 && e <= 5;
        g.append("circle").attr("cx", x(a0)).attr("cy", y(e0)).attr("r", 5).attr("fill", good(e0) ? colors[0] : "#ffffff").attr("stroke", good(e0) ? colors[0] : "#a5232b").attr("stroke-width", 2);
        if (known(a1)) g.append("rect").attr("x", x(a1) - 4.5).attr("y", y(e1) - 4.5).attr("width", 9).attr("height", 9).attr("fill", good(e1) ? colors[0] : "#ffffff").attr("stroke", good(e1) ? colors[0] : "#a5232b").attr("stroke-width", 2);
        g.append("text").attr("x", x(a0)).attr("y", y(e0) - 9).attr("text-anchor", "middle").text(n + 1);
      });
    });
    svg.append("g").attr("class", "axis").attr("transform", `translate(0,${height - margin.bottom})`).call(d3.axisBottom(x).ticks(8));
    svg.append("text").attr("x", (width + margin.left) / 2).attr("y", height - 6).attr("text-anchor", "middle").text("along the edge [mm]");
    return figure(svg, "The edge unrolled. Circle: entry; square: exit; number: order. Filled: 3 to 5 mm from the edge (blue band); hollow: outside. The band is the general one for bowel and not validated for this simulator; the rubric decides the score.",
      asTable("Bites", ["bite", "along, in [mm]", "along, out [mm]", "edge, in [mm]", "edge, out [mm]", "spacing [mm]"],
              placed.map((b, n) => [n + 1, b.along_mm[0], b.along_mm[1], b.edge_mm[0], b.edge_mm[1], b.spacing_mm])));
  }

  function learningCurve(task, goal) {
    const points = task.sessions.map((s, i) => [i + 1, s.score]).filter((p) => known(p[1]));
    if (!points.length) return null;
    const curve = task.curve || [];
    return lineChart({
      series: [{name: "this trainee", points, dots: true}].concat(curve.length ? [{name: "median of the cohort", points: curve.map((c) => [c.attempt, c.median])}] : []),
      bands: curve.length ? [{points: curve.map((c) => [c.attempt, c.q1, c.q3])}] : [],
      levels: known(goal) ? [{y: goal, name: "goal"}] : [],
      xLabel: "attempt", yLabel: "score [points]", xFormat: (v) => (Number.isInteger(v) ? v : ""),
      description: `Learning curve of ${words(task.task)}: ${points.length} scored attempts, first ${number(points[0][1])}, last ${number(points[points.length - 1][1])}`,
      caption: "Score by attempt." + (curve.length ? " Blue band: middle half of the cohort at the same attempt (at least three people)." : ""),
      numbers: asTable("Score by attempt", ["attempt", "score"], points)});
  }

  function cusumChart(c, name) {
    if (!c || !c.line.length) return null;
    const last = c.line[c.line.length - 1];
    const verdict = last <= -c.h0 ? `The line is below the lower limit: the failure rate is acceptable (${100 * c.p0} % or less).`
      : last >= c.h1 ? `The line is above the upper limit: the failure rate is not acceptable (${100 * c.p1} % or more).`
      : "The line is between the limits: more attempts are needed for a conclusion.";
    return lineChart({
      height: 260, series: [{name: "CUSUM", points: [[0, 0]].concat(c.line.map((v, i) => [i + 1, v])), dots: true}],
      levels: [{y: c.h1, name: `upper limit ${number(c.h1, 3)}`}, {y: -c.h0, name: `lower limit ${number(-c.h0, 3)}`}],
      xLabel: "judged attempt", yLabel: "CUSUM", xFormat: (v) => (Number.isInteger(v) ? v : ""),
      description: `CUSUM of ${name}: ${c.line.length} judged attempts, now ${number(last, 3)}`,
      caption: `${verdict} A pass subtracts ${number(c.s, 3)}, a fail adds ${number(1 - c.s, 3)}. Acceptable rate of failure ${100 * c.p0} %, unacceptable ${100 * c.p1} %, probability of each wrong conclusion ${100 * c.alpha} %.`,
      numbers: asTable("CUSUM by attempt", ["attempt", "CUSUM"], c.line.map((v, i) => [i + 1, v]))});
  }

  const data = () => JSON.parse(document.getElementById("data").textContent);
  function section(title, ...children) { return el("section", {"aria-label": title}, el("h2", {}, title), children); }
  function show(header, main) {
    document.getElementById("root").replaceWith(el("header", {}, header), el("main", {id: "page", tabindex: "-1"}, main),
      el("footer", {}, el("p", {class: "quiet"}, "Scores of this simulator are for training. They are not validated against the performance of people in the operating room.")));
  }
  function tiles(list) {
    return el("dl", {class: "tiles"}, list.filter(Boolean).map(([name, value, more, kind]) =>
      el("div", {}, el("dt", {}, name), el("dd", {class: kind || null}, value, more ? el("small", {}, " " + more) : null))));
  }
  return {el, known, number, words, unit, time, day, table, asTable, lineChart, boxChart, stitchMap, learningCurve, cusumChart, data, section, show, tiles};
})();
