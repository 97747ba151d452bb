// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>

#include "core/error.h"
#include "reference/json_view.h"
#include "report/html.h"
#include "report/report.h"

namespace brdfc::report {

namespace fs = std::filesystem;

std::vector<ConformanceTable> load_conformance(const fs::path& folder) {
  std::vector<fs::path> files;
  if (fs::is_directory(folder))
    for (const auto& entry : fs::directory_iterator(folder))
      if (entry.path().extension() == ".json") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  std::vector<ConformanceTable> tables;
  for (const fs::path& file : files) {
    const nlohmann::json json = reference::read_json(file);
    const reference::JsonView top(json, file.string());
    ConformanceTable table;
    table.blender = top.at("blender").text();
    for (const reference::JsonView& row : top.at("closures").elements()) {
      ConformanceRow r;
      r.closure = row.at("closure").text();
      r.verdict = row.at("verdict").choice({"ok", "mended", "fault"});
      if (const auto l1 = row.find("evaluation_l1")) r.evaluation_l1 = l1->number(0, 1e12);
      r.sampling_share = row.at("sampling_share").number(-1e12, 1e12);
      r.sampling_resolution = row.at("sampling_resolution").number(0, 1e12);
      if (r.verdict == "fault") r.fault = row.at("fault").text();
      table.rows.push_back(std::move(r));
    }
    tables.push_back(std::move(table));
  }
  return tables;
}

void put_conformance(std::string& out, const std::vector<ConformanceTable>& tables) {
  if (tables.empty()) return;
  out +=
      "<section id=\"closures\"><h2>Closures of Cycles</h2>\n<p>Behaviour of each closure in "
      "every tested version of Blender: the error of its evaluation relative to our definition (relative L1), and the "
      "difference between the light found by its own sampling and by its evaluation. Forms use no closure that is "
      "marked.</p>\n<div class=\"wide\"><table><thead><tr><th class=\"left\">Closure</th>";
  for (const ConformanceTable& t : tables)
    put(out, "<th>{}<br>evaluation</th><th>sampling<br>(resolution)</th>", escaped(t.blender));
  out += "</tr></thead><tbody>\n";
  std::vector<std::string> closures;
  for (const ConformanceTable& t : tables)
    for (const ConformanceRow& r : t.rows)
      if (std::find(closures.begin(), closures.end(), r.closure) == closures.end()) closures.push_back(r.closure);
  for (const std::string& closure : closures) {
    put(out, "<tr><td class=\"left\">{}</td>", escaped(closure));
    for (const ConformanceTable& t : tables) {
      const auto r =
          std::find_if(t.rows.begin(), t.rows.end(), [&](const ConformanceRow& row) { return row.closure == closure; });
      if (r == t.rows.end()) {
        put(out, "<td>{}</td><td>{}</td>", kDash, kDash);
        continue;
      }
      put(out, "<td>{}</td><td{} title=\"{}\">{} ({:.1f} %)</td>",
          or_dash(r->evaluation_l1, scientific(r->evaluation_l1.value_or(0))),
          r->verdict == "fault" ? " class=\"bad\"" : "", escaped(r->fault),
          r->sampling_share == 0 ? "agrees" : with_minus(fmt::format("{:+.1f} %", 100 * r->sampling_share)),
          100 * r->sampling_resolution);
    }
    out += "</tr>\n";
  }
  out += "</tbody></table></div></section>\n";
}

}  // namespace brdfc::report
