#include "hm/pipeline/common/parameters.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "program.hpp"

namespace {

struct ParamsFlags {
  std::string name, file, other;
  bool markdown = false, expert = false;
};

hm::JsonValue as_json(const hm::ParamList& list) {
  auto json = hm::JsonValue::object();
  for (const hm::ParamRef& param : list.all()) json[param.name] = hm::value_text(param);
  return json;
}

hm::Result<Outcome> show(const ParamsFlags& flags, Session& session) {
  const AllParameters all = session.all_parameters();
  const hm::ParamList& list = all.list;
  if (const auto applied = session.apply(list); !applied) return hm::forward_error(applied);
  Outcome outcome;
  const hm::ParamLevel least = flags.expert ? hm::ParamLevel::kExpert : hm::ParamLevel::kBasic;
  outcome.json["parameters"] = as_json(list);
  outcome.text = list.to_toml(least);
  if (flags.markdown)
    outcome.text = hm::to_markdown(list, hm::ParamLevel::kBasic) + "\n# Expert parameters\n" +
                   hm::to_markdown(list, hm::ParamLevel::kExpert);
  else if (!flags.expert)
    outcome.text +=
        fmt::format("\n# {} of {} parameters; all of them: hm params show --expert\n",
                    std::ranges::count(list.all(), least, &hm::ParamRef::level), list.all().size());
  return outcome;
}

hm::Result<Outcome> check(const ParamsFlags& flags, Session& session) {
  AllParameters all = session.all_parameters();
  if (const auto result = all.read(flags.file); !result) return hm::forward_error(result);
  Outcome outcome;
  outcome.text = flags.file + ": valid\n";
  return outcome;
}

hm::Result<Outcome> explain(const ParamsFlags& flags, Session& session) {
  AllParameters all = session.all_parameters();
  Outcome outcome;
  for (const hm::ParamRef& param : all.list.all()) {
    const std::size_t dot = param.name.find('.');
    if (param.name != flags.name && param.name.substr(0, dot) != flags.name &&
        param.name.substr(dot + 1) != flags.name)
      continue;
    outcome.text += hm::explain(param);
    outcome.json["parameters"][param.name] =
        hm::JsonValue::object({{"value", hm::value_text(param)}, {"help", param.help}});
  }
  if (!outcome.text.empty()) return outcome;
  // Setting it fails with the words that name the nearest one.
  const auto unknown = all.list.set(flags.name + "=0");
  return hm::fail(hm::ErrorCode::kUsage, {}, "{}", unknown ? "unknown parameter" : unknown.error().message);
}

hm::Result<Outcome> diff(const ParamsFlags& flags, Session& session) {
  AllParameters a = session.all_parameters(), b = session.all_parameters();
  if (const auto result = a.read(flags.file); !result) return hm::forward_error(result);
  if (const auto result = b.read(flags.other); !result) return hm::forward_error(result);
  const std::span<const hm::ParamRef> of_a = a.list.all(), of_b = b.list.all();
  Outcome outcome;
  outcome.json["differences"] = hm::JsonValue::object();
  for (std::size_t i = 0; i < of_a.size(); ++i) {
    const std::string left = hm::value_text(of_a[i]), right = hm::value_text(of_b[i]);
    if (left == right) continue;
    outcome.text += fmt::format("{}: {} -> {}\n", of_a[i].name, left, right);
    outcome.json["differences"][of_a[i].name] = hm::JsonValue::object({{"a", left}, {"b", right}});
  }
  if (outcome.text.empty()) outcome.text = "no difference\n";
  return outcome;
}

void add_params(Program& program) {
  program.add({"params",
               "Show, check, explain, compare parameters.",
               "  hm params show\n"
               "  hm params explain tsdf.voxel_size_m\n"
               "  hm params check result/parameters.toml",
               {}});
  auto flags = std::make_shared<ParamsFlags>();
  Command show_command = program.add(
      {"params show", "Show the usual parameters as TOML, with --params and --set applied; --expert: all.",
       "  hm params show\n  hm params show --expert\n  hm params show --set tsdf.voxel_size_m=0.01\n  hm "
       "params show --markdown",
       [flags](Session& session) { return show(*flags, session); }});
  show_command.add_flag("--expert", flags->expert, "also show the expert parameters");
  show_command.add_flag("--markdown", flags->markdown, "as the tables in docs/parameters.md");
  program
      .add({"params check", "Check a parameter file and report every wrong line.",
            "  hm params check result/parameters.toml",
            [flags](Session& session) { return check(*flags, session); }})
      .add_option("file", flags->file, "TOML file")
      .required();
  program
      .add({"params explain", "Explain a parameter or a section.",
            "  hm params explain tsdf.far_m\n  hm params explain mesh",
            [flags](Session& session) { return explain(*flags, session); }})
      .add_option("name", flags->name, "section.key, section, or key")
      .required();
  Command diff_command = program.add({"params diff", "Show the differences between two parameter files.",
                                      "  hm params diff result/parameters.toml other/parameters.toml",
                                      [flags](Session& session) { return diff(*flags, session); }});
  diff_command.add_option("a", flags->file, "TOML file").required();
  diff_command.add_option("b", flags->other, "TOML file").required();
}

const VerbRegistration kParams(110, add_params);

}  // namespace
