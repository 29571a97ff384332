#include "nodes/verbs/verify_report.hpp"

#include <fmt/format.h>

#include "nodes/verbs/verb_tools.hpp"

namespace afterglow::nodes {
namespace {

using Align = TextTable::Align;

void addSummary(nlohmann::ordered_json& json, const calib::ErrorSummary& summary) {
  json["corners"] = summary.corners;
  const auto value = [&](double mm) {
    return summary.corners == 0 ? nlohmann::ordered_json() : nlohmann::ordered_json(mm);
  };
  json["median_mm"] = value(summary.median_mm);
  json["p95_mm"] = value(summary.p95_mm);
  json["max_mm"] = value(summary.max_mm);
}

std::string inMm(double mm) { return fmt::format("{:.2f}", mm); }

std::string headline(const calib::ErrorSummary& summary) {
  return fmt::format("median {:.2f} mm, p95 {:.2f} mm, max {:.2f} mm over {} corners\n",
                     summary.median_mm, summary.p95_mm, summary.max_mm, summary.corners);
}

}  // namespace

calib::ErrorSummary summaryOf(const std::vector<calib::ViewCheck>& views) {
  std::vector<calib::LandingError> all;
  for (const calib::ViewCheck& view : views) {
    all.insert(all.end(), view.errors.begin(), view.errors.end());
  }
  return calib::summarize(all);
}

nlohmann::ordered_json verifyJson(const std::vector<calib::ViewCheck>& views) {
  nlohmann::ordered_json json = {{"method", "views"}, {"views", nlohmann::ordered_json::array()}};
  for (const calib::ViewCheck& view : views) {
    nlohmann::ordered_json entry = {{"name", view.name}};
    addSummary(entry, calib::summarize(view.errors));
    entry["fault"] = view.fault;
    json["views"].push_back(entry);
  }
  addSummary(json, summaryOf(views));
  return json;
}

std::string verifyText(const std::vector<calib::ViewCheck>& views) {
  TextTable table({{"VIEW", Align::Left},
                   {"CORNERS", Align::Right},
                   {"MEDIAN MM", Align::Right},
                   {"P95", Align::Right},
                   {"MAX", Align::Right}});
  std::string faults;
  for (const calib::ViewCheck& view : views) {
    if (!view.fault.empty()) {
      faults += view.name + ": not measured: " + view.fault + "\n";
      continue;
    }
    const calib::ErrorSummary summary = calib::summarize(view.errors);
    table.add({view.name, std::to_string(summary.corners), inMm(summary.median_mm),
               inMm(summary.p95_mm), inMm(summary.max_mm)});
  }
  const calib::ErrorSummary all = summaryOf(views);
  if (all.corners == 0) return faults;
  return table.text() + faults + headline(all);
}

nlohmann::ordered_json verifyJson(const calib::ThrowCheck& check) {
  nlohmann::ordered_json json = {{"method", "targets"},
                                 {"printed_tags", check.surface.tags.size()},
                                 {"printed_rms_px", check.surface.rms_px},
                                 {"targets", nlohmann::ordered_json::array()}};
  for (const calib::TargetCheck& target : check.targets) {
    nlohmann::ordered_json entry = {{"id", target.id},     {"seen", target.is_seen},
                                    {"dx_mm", nullptr},    {"dy_mm", nullptr},
                                    {"error_mm", nullptr}, {"max_mm", nullptr}};
    if (target.is_seen) {
      entry["dx_mm"] = target.offset_mm.x();
      entry["dy_mm"] = target.offset_mm.y();
      entry["error_mm"] = target.offset_mm.norm();
      entry["max_mm"] = calib::summarize(target.errors).max_mm;
    }
    json["targets"].push_back(entry);
  }
  addSummary(json, calib::summarize(check.errors()));
  return json;
}

std::string verifyText(const calib::ThrowCheck& check) {
  TextTable table({{"TARGET", Align::Left},
                   {"DX MM", Align::Right},
                   {"DY MM", Align::Right},
                   {"ERROR MM", Align::Right},
                   {"WORST CORNER", Align::Right}});
  for (const calib::TargetCheck& target : check.targets) {
    const std::string id = std::to_string(target.id);
    if (!target.is_seen) {
      table.add({id, "not seen", "", "", ""});
      continue;
    }
    table.add({id, inMm(target.offset_mm.x()), inMm(target.offset_mm.y()),
               inMm(target.offset_mm.norm()), inMm(calib::summarize(target.errors).max_mm)});
  }
  const calib::ErrorSummary all = calib::summarize(check.errors());
  const std::string surface = fmt::format("{} printed tags, fitting to {:.2f} px\n",
                                          check.surface.tags.size(), check.surface.rms_px);
  return table.text() + surface + (all.corners == 0 ? "" : headline(all));
}

}  // namespace afterglow::nodes
