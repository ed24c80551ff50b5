#include "cli/launch/trajectory_score.h"

#include <fmt/format.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "base/errors.h"
#include "base/random.h"
#include "base/run_layout.h"
#include "base/sha256.h"
#include "base/text.h"
#include "bus/channels.h"
#include "bus/event_log.h"
#include "bus/message.h"
#include "cli/launch/trajectory_table.h"
#include "cli/launch/version.h"
#include "cli/results/episode_json.h"
#include "cli/results/run_folder.h"
#include "cli/results/run_reader.h"
#include "cli/results/summary_table.h"
#include "collision/clearance_watch.h"
#include "lcmtypes/clock.h"
#include "lcmtypes/end_reason.h"
#include "metrics/episode/episode_scorer.h"
#include "sim/prepared_scene.h"
#include "sim/world.h"
#include "viz/terminal/terminal.h"

namespace evalbus::launch {
namespace {

namespace fs = std::filesystem;

constexpr double kDegree = 3.14159265358979323846 / 180;
// A joint may be measured this far beyond its range, rad or m.
constexpr double kBeyondRange = 0.05;
// Samples further apart than so many times the usual leave a gap.
constexpr double kGap = 3;

double OneOf(const YamlValue& value, const std::map<std::string, double>& units) {
  const auto found = units.find(value.Text());
  if (found != units.end()) return found->second;
  std::string expected;
  for (const auto& [unit, scale] : units) expected += (expected.empty() ? "" : " or ") + unit;
  value.Fail("expected " + expected + ", got '" + value.Text() + "'");
}

// A trajectory as columns, one value per sample.
struct Samples {
  std::vector<double> time;                              // s, from 0
  std::map<int, std::vector<double>> qpos;               // by coordinate
  std::vector<std::vector<double>> opening;              // by gripper
  std::map<int, std::vector<std::vector<double>>> pose;  // by object: 7 columns
};

// The scene of all trajectories of a map.
class Kinematics {
 public:
  explicit Kinematics(const TrajectoryMap& map) : map_(map) {
    options_.task = map.task;
    if (!map.robot.empty()) options_.robot = map.robot;
    options_.control_hz = map.control_hz;
  }

  void Prepare(const fs::path& out) {
    options_.out = out;
    options_.run_id = NameOfRun(out);
    prepared_ = std::make_unique<sim::PreparedScene>(sim::PrepareScene(options_));
    model_ = prepared_->scene.physics.get();
    model_info_t& info = prepared_->info;
    info.source = "file";
    info.has_physics = info.has_velocity = 0;
    world_ = std::make_unique<sim::World>(model_, info, prepared_->robot, prepared_->task, info.substeps);
    world_->Reset(0, Variation{});
    data_.reset(mj_makeData(model_));
    CheckNames();
    checker_ = std::make_unique<collision::CollisionChecker>(model_, info);
    scorer_ = std::make_unique<metrics::EpisodeScorer>(info, prepared_->task);
  }

  const sim::PreparedScene& prepared() const { return *prepared_; }
  const model_info_t& info() const { return prepared_->info; }

  Samples Read(const fs::path& file) const;
  // Writes the log and returns the score. `gaps`: places where samples are missing.
  episode_summary_t Score(const Samples& samples, int episode, const fs::path& log, int* gaps);

 private:
  // Every joint of the arms and every gripper is mapped; what is mapped is there; which objects are tracked.
  void CheckNames();
  int Joint(const std::string& name) const { return mj_name2id(model_, mjOBJ_JOINT, name.c_str()); }
  state_t StateAt(const Samples& samples, double time, size_t after, const state_t* before,
                  const header_t& header);

  TrajectoryMap map_;
  sim::SimOptions options_;
  std::unique_ptr<sim::PreparedScene> prepared_;
  const mjModel* model_ = nullptr;
  std::unique_ptr<sim::World> world_;
  DataPtr data_;
  std::unique_ptr<collision::CollisionChecker> checker_;
  std::unique_ptr<metrics::EpisodeScorer> scorer_;
};

void Kinematics::CheckNames() {
  model_info_t& info = prepared_->info;
  for (const arm_info_t& arm : info.arm) {
    for (const std::string& joint : arm.joint_name) {
      if (!map_.joints.contains(joint)) {
        throw InputError(map_.file + ": joints: '" + joint +
                         "' is missing; all joints of the arms are needed");
      }
    }
  }
  for (const auto& [name, column] : map_.joints) {
    if (Joint(name) < 0) column.Fail("no joint is called '" + name + "'" + Suggestion(name, info.joint_name));
  }
  std::vector<std::string> grippers;
  for (const gripper_info_t& gripper : info.gripper) {
    grippers.push_back(gripper.name);
    if (!map_.grippers.contains(gripper.name)) {
      throw InputError(map_.file + ": grippers: '" + gripper.name +
                       "' is missing; one that was not recorded is said to be 'open' or 'closed'");
    }
  }
  for (const auto& [name, gripper] : map_.grippers) {
    if (std::ranges::find(grippers, name) == grippers.end()) {
      throw InputError(map_.file + ": grippers: no gripper is called '" + name + "'" +
                       Suggestion(name, grippers));
    }
  }
  for (const auto& [name, object] : map_.objects) {
    if (std::ranges::find(info.object_name, name) == info.object_name.end()) {
      object.where.Fail("no object is called '" + name + "'" + Suggestion(name, info.object_name));
    }
  }
  for (int k = 0; k < info.num_objects; ++k) {
    const std::string& name = info.object_name[k];
    const int body = mj_name2id(model_, mjOBJ_BODY, name.c_str());
    const bool is_free =
        model_->body_jntnum[body] > 0 && model_->jnt_type[model_->body_jntadr[body]] == mjJNT_FREE;
    const bool is_movable = is_free || model_->body_mocapid[body] >= 0;
    bool tracked = map_.objects.contains(name) == is_movable;
    if (!is_movable && map_.objects.contains(name)) {
      map_.objects.at(name).where.Fail("'" + name + "' stands still in this task; map its joints instead");
    }
    for (int joint = 0; joint < info.num_joints; ++joint) {
      const std::string& its = info.joint_name[joint];
      if (its.starts_with(name + "/")) tracked = tracked && map_.joints.contains(its);
    }
    info.object_is_tracked[k] = tracked;
  }
}

Samples Kinematics::Read(const fs::path& file) const {
  const std::unique_ptr<TrajectoryTable> table = OpenTable(file);
  Samples samples;
  for (const auto& [name, where] : map_.joints) {
    std::vector<double> column = table->Column(where.Text());
    const int joint = Joint(name);
    const bool slides = model_->jnt_type[joint] == mjJNT_SLIDE;
    const double lower = model_->jnt_range[2 * joint], upper = model_->jnt_range[2 * joint + 1];
    for (size_t row = 0; row < column.size(); ++row) {
      if (!slides) column[row] *= map_.joint_scale;
      if (!model_->jnt_limited[joint] ||
          (column[row] >= lower - kBeyondRange && column[row] <= upper + kBeyondRange)) {
        continue;
      }
      const bool degrees = !slides && !map_.joints_in_degrees &&
                           column[row] * kDegree >= lower - kBeyondRange &&
                           column[row] * kDegree <= upper + kBeyondRange;
      throw InputError(fmt::format("{}: column '{}': {:.4g} {} is beyond the range of {}, {:.3f} to {:.3f}{}",
                                   table->Place(row), Printable(where.Text()), column[row],
                                   slides ? "m" : "rad", name, lower, upper,
                                   degrees ? "; are these degrees (joints: unit: deg)?" : ""));
    }
    samples.qpos[model_->jnt_qposadr[joint]] = std::move(column);
  }
  const size_t rows = samples.qpos.begin()->second.size();
  if (map_.time_column.empty()) {
    for (size_t row = 0; row < rows; ++row) samples.time.push_back(static_cast<double>(row) / map_.rate_hz);
  } else {
    samples.time = table->Column(map_.time_column);
    for (size_t row = 1; row < rows; ++row) {
      if (samples.time[row] > samples.time[row - 1]) continue;
      throw InputError(fmt::format("{}: column '{}': the time goes from {:g} to {:g}; it must go up",
                                   table->Place(row), Printable(map_.time_column), samples.time[row - 1],
                                   samples.time[row]));
    }
    const double first = samples.time[0];
    for (double& time : samples.time) time = (time - first) * map_.time_scale;
  }
  for (const gripper_info_t& gripper : info().gripper) {
    const TrajectoryMap::Gripper& how = map_.grippers.at(gripper.name);
    std::vector<double>& opening = samples.opening.emplace_back(rows, how.always);
    if (how.column.empty()) continue;
    const std::vector<double> column = table->Column(how.column);
    for (size_t row = 0; row < rows; ++row) {
      opening[row] = (column[row] - how.closed) / (how.open - how.closed);
      if (opening[row] >= -0.1 && opening[row] <= 1.1) continue;
      throw InputError(fmt::format("{}: column '{}': {:g} is not between closed ({:g}) and open ({:g})",
                                   table->Place(row), Printable(how.column), column[row], how.closed,
                                   how.open));
    }
  }
  for (int k = 0; k < info().num_objects; ++k) {
    const auto object = map_.objects.find(info().object_name[k]);
    if (object == map_.objects.end()) continue;
    std::vector<std::vector<double>>& pose = samples.pose[k];
    for (const std::string& name : object->second.position) pose.push_back(table->Column(name));
    for (const std::string& name : object->second.quaternion) pose.push_back(table->Column(name));
    for (size_t row = 0; row < rows; ++row) {
      const double norm =
          std::hypot(std::hypot(pose[3][row], pose[4][row]), std::hypot(pose[5][row], pose[6][row]));
      if (std::abs(norm - 1) <= 0.01) continue;
      throw InputError(fmt::format("{}: the quaternion of '{}' has norm {:.3g}, expected 1",
                                   table->Place(row), object->first, norm));
    }
  }
  return samples;
}

// At a time: linearly between the samples before and behind it.
state_t Kinematics::StateAt(const Samples& samples, double time, size_t after, const state_t* before,
                            const header_t& header) {
  const size_t b = after, a = after == 0 ? 0 : after - 1;
  const double share = a == b ? 0 : (time - samples.time[a]) / (samples.time[b] - samples.time[a]);
  const auto at = [&](const std::vector<double>& column) {
    return column[a] + share * (column[b] - column[a]);
  };
  mjData& d = *data_;
  mju_copy(d.qpos, world_->data().qpos, model_->nq);
  mju_copy(d.mocap_pos, world_->data().mocap_pos, 3 * model_->nmocap);
  mju_copy(d.mocap_quat, world_->data().mocap_quat, 4 * model_->nmocap);
  for (const auto& [coordinate, column] : samples.qpos) d.qpos[coordinate] = at(column);
  state_t state{};
  for (size_t k = 0; k < samples.opening.size(); ++k) {
    const GripperDescription& gripper = prepared_->robot.grippers[k];
    const double opening = std::clamp(at(samples.opening[k]), 0.0, 1.0);
    state.gripper.push_back({opening});
    for (const std::string& joint : gripper.joints) {
      const std::string name = gripper.prefix() + joint;
      if (map_.joints.contains(name)) continue;
      d.qpos[model_->jnt_qposadr[Joint(name)]] =
          gripper.joint_closed + opening * (gripper.joint_open - gripper.joint_closed);
    }
  }
  for (const auto& [object, columns] : samples.pose) {
    const int body = mj_name2id(model_, mjOBJ_BODY, info().object_name[object].c_str());
    const int mocap = model_->body_mocapid[body];
    double* position =
        mocap >= 0 ? d.mocap_pos + 3 * mocap : d.qpos + model_->jnt_qposadr[model_->body_jntadr[body]];
    double* quaternion = mocap >= 0 ? d.mocap_quat + 4 * mocap : position + 3;
    double dot = 0;
    for (size_t i = 3; i < 7; ++i) dot += columns[i][a] * columns[i][b];
    for (size_t i = 0; i < 3; ++i) position[i] = at(columns[i]);
    // q and -q are one rotation: the shorter way.
    for (size_t i = 0; i < 4; ++i) {
      const std::vector<double>& column = columns[3 + i];
      quaternion[i] = column[a] + share * ((dot < 0 ? -1 : 1) * column[b] - column[a]);
    }
    mju_normalize4(quaternion);
  }
  mj_kinematics(model_, &d);

  state.header = header;
  state.num_qpos = model_->nq;
  state.qpos_mixed.assign(d.qpos, d.qpos + model_->nq);
  state.num_qvel = model_->nv;
  state.qvel_mixed.assign(static_cast<size_t>(model_->nv), 0);
  state.num_bodies = model_->nbody;
  state.body.resize(static_cast<size_t>(model_->nbody));
  for (int i = 0; i < model_->nbody; ++i) {
    mju_copy3(state.body[static_cast<size_t>(i)].position_m, d.xpos + 3 * i);
    mju_copy4(state.body[static_cast<size_t>(i)].quat_wxyz, d.xquat + 4 * i);
  }
  state.num_grippers = static_cast<int32_t>(state.gripper.size());
  for (const arm_info_t& arm : info().arm) {
    arm_state_t out{};
    out.num_joints = arm.num_joints;
    for (const int index : arm.joint_qpos_index) out.joint_position_rad.push_back(d.qpos[index]);
    out.joint_velocity_radps.assign(static_cast<size_t>(arm.num_joints), 0);
    out.joint_torque_Nm.assign(static_cast<size_t>(arm.num_joints), 0);
    if (before) {
      const std::vector<double>& was = before->arm[state.arm.size()].joint_position_rad;
      const double elapsed = Seconds(header.sim_time_us - before->header.sim_time_us);
      for (size_t j = 0; j < was.size(); ++j)
        out.joint_velocity_radps[j] = (out.joint_position_rad[j] - was[j]) / elapsed;
    }
    const int site = mj_name2id(model_, mjOBJ_SITE, arm.wrist_site.c_str());
    mju_copy3(out.wrist_position_m, d.site_xpos + 3 * site);
    mju_mat2Quat(out.wrist_quat_wxyz, d.site_xmat + 9 * site);
    state.arm.push_back(std::move(out));
  }
  state.num_arms = static_cast<int32_t>(state.arm.size());
  return state;
}

episode_summary_t Kinematics::Score(const Samples& samples, int episode, const fs::path& log, int* gaps) {
  EventLogWriter writer(log);
  const auto write = [&](const auto& channel, const auto& message, int64_t time_us) {
    writer.Write(channel.name, Encode(message), time_us);
  };
  episode_begin_t begin{};
  begin.header.episode = episode;
  begin.seed = EpisodeSeed(0, episode);
  write(channels::kModel, info(), 0);
  write(channels::kEpisodeBegin, begin, 0);
  scorer_->Start();
  const int64_t tick_us = ControlPeriodUs(info());
  collision::ClearanceWatch clearance(checker_.get(), tick_us);
  clearance.Start();

  std::vector<double> steps;
  for (size_t i = 1; i < samples.time.size(); ++i) steps.push_back(samples.time[i] - samples.time[i - 1]);
  double usual = 0;
  if (!steps.empty()) {
    std::ranges::nth_element(steps, steps.begin() + static_cast<ptrdiff_t>(steps.size() / 2));
    usual = steps[steps.size() / 2];
  }
  const double longest = kGap * std::max(usual, Seconds(tick_us));

  episode_end_t end{};
  end.end_reason = end_reason::kEndOfData;
  std::optional<state_t> before;
  std::optional<size_t> gap;
  size_t after = 0;
  header_t header = begin.header;
  for (int64_t tick = 0;; ++tick) {
    const double time = Seconds(tick * tick_us);
    // 1e-9: a tick on a sample is that sample.
    while (after < samples.time.size() && samples.time[after] < time - 1e-9) ++after;
    if (after == samples.time.size()) break;
    header.tick = tick;
    header.sim_time_us = tick * tick_us;
    const bool between = after > 0 && samples.time[after] > time + 1e-9;
    if (between && samples.time[after] - samples.time[after - 1] > longest) {
      if (gap != after) ++*gaps;
      gap = after;
      continue;
    }
    state_t state = StateAt(samples, time, after, before ? &*before : nullptr, header);
    for (int body = 0; body < state.num_bodies; ++body) {
      checker_->SetBodyPose(body, state.body[body].position_m, state.body[body].quat_wxyz);
    }
    contacts_t contacts{};
    contacts.header = header;
    contacts.contact = checker_->FindContacts();
    contacts.num_contacts = static_cast<int32_t>(contacts.contact.size());
    const auto nearest = clearance.At(tick, contacts.contact);
    contacts.has_clearance = nearest.has_value();
    contacts.clearance_m = nearest ? nearest->distance : 0;
    contacts.clearance_robot_geom = nearest ? nearest->robot_geom : -1;
    contacts.clearance_scene_geom = nearest ? nearest->scene_geom : -1;
    write(channels::kState, state, header.sim_time_us);
    write(channels::kContacts, contacts, header.sim_time_us);
    scorer_->Tick(state, contacts);
    partial_metrics_t partial{};
    scorer_->Partial(&partial);
    write(channels::kPartial, partial, header.sim_time_us);
    before = std::move(state);
    if (partial.verdict != partial_metrics_t::UNDECIDED) {
      end.end_reason = end_reason::Of(partial.verdict);
      break;
    }
    if (info().time_limit_us > 0 && header.sim_time_us >= info().time_limit_us) {
      end.end_reason = end_reason::kTimeLimit;
      break;
    }
  }
  end.header = header;
  if (*gaps > 0) end.detail = fmt::format("samples are missing in {} place{}", *gaps, *gaps == 1 ? "" : "s");
  scorer_->EndAt(header.tick);
  const episode_summary_t summary = scorer_->Summary(begin, end);
  write(channels::kEpisodeEnd, end, header.sim_time_us);
  write(channels::kEpisodeSummary, summary, header.sim_time_us);
  writer.Close();
  return summary;
}

}  // namespace

TrajectoryMap ReadTrajectoryMap(const std::string& text, const std::string& file) {
  const YamlMap yaml(ParseYaml(text, file), {"task", "joints"},
                     {"robot", "control_hz", "time", "rate_hz", "grippers", "objects"});
  TrajectoryMap map;
  map.file = file;
  map.task = yaml["task"].Text();
  if (const YamlValue* robot = yaml.Find("robot")) map.robot = robot->Text();
  if (const YamlValue* hz = yaml.Find("control_hz")) map.control_hz = hz->Number({.min = 5, .max = 500});
  const YamlValue *time = yaml.Find("time"), *rate = yaml.Find("rate_hz");
  if (!time == !rate) throw InputError(file + ": expected either 'time', a column, or 'rate_hz'");
  if (rate) map.rate_hz = rate->Number({.min = 0.1, .max = 1e5});
  if (time) {
    const YamlMap entries(*time, {"column", "unit"});
    map.time_column = entries["column"].Text();
    map.time_scale = OneOf(entries["unit"], {{"s", 1}, {"ms", 1e-3}, {"us", 1e-6}, {"ns", 1e-9}});
  }
  const YamlMap joints(yaml["joints"], {"unit", "columns"});
  map.joint_scale = OneOf(joints["unit"], {{"rad", 1}, {"deg", kDegree}});
  map.joints_in_degrees = map.joint_scale != 1;
  for (const YamlValue& entry : joints["columns"].Entries()) {
    entry.Text();
    map.joints.emplace(entry.key(), entry);
  }
  if (map.joints.empty()) joints["columns"].Fail("expected a column for each joint");
  if (const YamlValue* grippers = yaml.Find("grippers")) {
    for (const YamlValue& entry : grippers->Entries()) {
      TrajectoryMap::Gripper& gripper = map.grippers[entry.key()];
      if (entry.is_scalar()) {
        gripper.always = OneOf(entry, {{"open", 1}, {"closed", 0}});
        continue;
      }
      const YamlMap column(entry, {"column", "open", "closed"});
      gripper.column = column["column"].Text();
      gripper.open = column["open"].Number();
      gripper.closed = column["closed"].Number();
      if (gripper.open == gripper.closed) column["open"].Fail("expected another value than 'closed'");
    }
  }
  if (const YamlValue* objects = yaml.Find("objects")) {
    for (const YamlValue& entry : objects->Entries()) {
      const YamlMap columns(entry, {"position_m", "quaternion_wxyz"});
      TrajectoryMap::Object& object = map.objects[entry.key()];
      object.where = entry;
      const auto read = [](const YamlValue& value, auto* names) {
        const std::vector<std::string> texts = value.Texts();
        if (texts.size() != names->size()) value.Fail(fmt::format("expected {} columns", names->size()));
        std::ranges::copy(texts, names->begin());
      };
      read(columns["position_m"], &object.position);
      read(columns["quaternion_wxyz"], &object.quaternion);
    }
  }
  return map;
}

void ScoreTrajectories(const fs::path& map_file, const fs::path& data, const fs::path& out) {
  const TrajectoryMap map = ReadTrajectoryMap(ReadText(map_file, "map of a trajectory"), map_file.string());
  std::vector<fs::path> files;
  if (fs::is_directory(data)) {
    for (const auto& entry : fs::directory_iterator(data)) {
      const std::string ending = entry.path().extension();
      const bool is_one = ending == ".csv" || ending == ".npz" || ending == ".hdf5" || ending == ".h5";
      if (entry.is_regular_file() && is_one) files.push_back(entry.path());
    }
    std::ranges::sort(files);
    if (files.empty()) throw InputError(data.string() + ": no *.csv, *.npz, *.hdf5 or *.h5 in it");
  } else {
    files = {data};
  }
  Kinematics kinematics(map);
  results::RunFolder folder = results::RunFolder::OfRun(out, "score", false);
  try {
    kinematics.Prepare(folder.path());
    // All are read before anything is scored.
    std::vector<Samples> all;
    for (const fs::path& file : files) all.push_back(kinematics.Read(file));
    const sim::PreparedScene& prepared = kinematics.prepared();
    nlohmann::ordered_json names = nlohmann::ordered_json::array();
    for (const fs::path& file : files) names.push_back(fs::absolute(file).lexically_normal().string());
    folder.WriteJson(kRunJson, {{"task", prepared.task.name},
                                {"variation", prepared.variation},
                                {"policy", data.filename().string()},
                                {"seed", 0},
                                {"episodes", files.size()},
                                {"control_hz", map.control_hz},
                                {"realtime", false},
                                {"source", "file"},
                                {"map", fs::absolute(map_file).lexically_normal().string()},
                                {"files", names},
                                {"task_sha256", Sha256Text(prepared.info.task_yaml)},
                                {"robot_sha256", Sha256File(prepared.robot.file)},
                                {"physics_sha256", prepared.info.physics_sha256},
                                {"visual_sha256", prepared.info.visual_sha256},
                                {"evalbus_version", kVersion},
                                {"git_commit", kGitCommit},
                                {"git_dirty", kGitDirty},
                                {"mujoco_version", mj_versionString()}});
    fmt::print("{}\n", results::EpisodeHeader(viz::TerminalWidth(stdout)));
    for (size_t i = 0; i < files.size(); ++i) {
      const int episode = static_cast<int>(i);
      fs::create_directories(EpisodeFolder(folder.path(), episode));
      int gaps = 0;
      const auto summary = kinematics.Score(all[i], episode, EpisodeLog(folder.path(), episode), &gaps);
      const auto json = results::EpisodeJson(prepared.task.name, prepared.variation, summary);
      folder.AddEpisode(episode, json);
      fmt::print("{}\n", results::EpisodeLine(json, viz::TerminalWidth(stdout)));
    }
    const metrics::RunSummary summary = results::ReadRun(folder.path()).Statistics().Summary(true);
    folder.WriteJson(kSummaryJson, metrics::SummaryJson(prepared.task.name, prepared.variation, summary));
    fmt::print("\n{}", results::SummaryTable(summary, viz::TerminalWidth(stdout)));
    fmt::print("\nresults  {}\n", (folder.shown() / kEpisodesJsonl).string());
  } catch (...) {
    folder.TakeAway();
    throw;
  }
}

}  // namespace evalbus::launch
