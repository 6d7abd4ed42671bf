// SPDX-License-Identifier: Apache-2.0
// serve: requests and answers; see server.h. Every page has a content policy that runs only the scripts of the page (a random
// nonce), and every form a token, so that another site can neither inject scripts nor send forms in a visitor's name.
#include "serve/server.h"

#include <fmt/format.h>
#include <httplib.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "core/check.h"
#include "report/csv.h"
#include "report/data.h"
#include "report/session_file.h"
#include "report/survey.h"
#include "serve/login.h"

namespace catgut {
namespace {
namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using httplib::Request;
using httplib::Response;

// A page that is not there, or not for this visitor.
struct Refused {
  int status;
  std::string text;
};

std::string cookie_of(const Request& request) {
  const std::string all = request.get_header_value("Cookie"), key = "catgut=";
  for (size_t at = 0; at < all.size();) {
    const size_t end = std::min(all.find(';', at), all.size());
    const size_t start = all.find_first_not_of(' ', at);
    if (start < end && all.compare(start, key.size(), key) == 0)
      return all.substr(start + key.size(), end - start - key.size());
    at = end + 1;
  }
  return "";
}

std::string parameter(const Request& request, const char* name) {
  return request.has_param(name) ? request.get_param_value(name) : "";
}

double number_or_unknown(const std::string& text) {
  if (text.empty()) return kUnknown;
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (*end != 0 || !(value > -1e9 && value < 1e9))
    throw InputError("form", fmt::format("\"{:.40}\" is not a number", text), "correct it");
  return value;
}

}  // namespace

bool is_loopback(const std::string& host) { return host == "localhost" || host == "::1" || host.rfind("127.", 0) == 0; }

struct PageServer::Work {
  ServeOptions options;
  std::unique_ptr<httplib::Server> server;
  std::thread thread;
  int port = 0;
  Visitors visitors;
  const std::string common_token = random_token();  // of forms while the store has no login
  std::mutex mutex;
  std::unique_ptr<Store> store;

  // One request at a time uses the store. After a fault the next request opens it again: a database server may be back.
  template <class Body>
  auto with_store(Body&& body) {
    const std::lock_guard lock(mutex);
    if (!store) store = std::make_unique<Store>(options.store);
    return body(*store);
  }

  bool tls() const { return !options.certificate.empty(); }

  // cpp-httplib compresses what set_content is given with Brotli's slowest setting, 1.5 s for the overview. A provider is sent
  // as it is.
  static void send_text(Response& response, std::string text, const char* type) {
    auto kept = std::make_shared<std::string>(std::move(text));
    response.set_content_provider(kept->size(), type, [kept](size_t offset, size_t length, httplib::DataSink& sink) {
      return sink.write(kept->data() + offset, length);
    });
  }

  void send_page(Response& response, const std::string& kind, const std::string& title, const std::string& data,
                 int status = 200) {
    const std::string nonce = random_token();
    response.status = status;
    response.set_header(
        "Content-Security-Policy",
        fmt::format("default-src 'none'; script-src 'nonce-{0}'; style-src 'nonce-{0}'; img-src 'self' data:; "
                    "media-src 'self'; connect-src 'self'; form-action 'self'; base-uri 'none'; frame-ancestors 'none'",
                    nonce));
    send_text(response, html_page(kind, title, data, nonce), "text/html; charset=utf-8");
  }

  void send_message(Response& response, int status, const std::string& title, const std::string& text) {
    Json j = {{"kind", "message"}, {"title", title}, {"text", text}};
    send_page(response, "form", title, j.dump(-1, ' ', false, Json::error_handler_t::replace), status);
  }

  // Empty: the visitor has to sign in.
  std::optional<Visitor> visitor(const Request& request) {
    const bool open = with_store([](Store& s) { return s.logins() == 0; });
    if (open) return Visitor{"", Role::staff, common_token};
    return visitors.find(cookie_of(request), Visitors::Clock::now());
  }

  // Pages of this machine answer only to its names: another site must not reach them by a name of its own (DNS rebinding).
  bool wrong_host(const Request& request) const {
    if (!is_loopback(options.host)) return false;
    std::string host = request.get_header_value("Host");
    host = host.substr(0, host.rfind(':') == std::string::npos || host.back() == ']' ? host.size() : host.rfind(':'));
    return host != "localhost" && host != "[::1]" && host.rfind("127.", 0) != 0;
  }

  using Answer = std::function<void(const Request&, Response&, const Visitor&, const std::vector<std::string>&)>;
  httplib::Server::Handler guarded(Answer answer, bool form) {
    return [this, answer = std::move(answer), form](const Request& request, Response& response) {
      try {
        const std::optional<Visitor> who = visitor(request);
        if (!who) {
          response.set_redirect("/login", 303);
          return;
        }
        if (form && !same_text(parameter(request, "token"), who->token))
          throw Refused{403, "The form is out of date. Open the page again."};
        std::vector<std::string> parts;
        for (size_t i = 1; i < request.matches.size(); ++i) parts.push_back(request.matches[i]);
        answer(request, response, *who, parts);
      } catch (const Refused& refused) {
        send_message(response, refused.status, refused.status == 404 ? "Not found" : "Not possible", refused.text);
      } catch (const InputError& error) {
        {
          const std::lock_guard lock(mutex);
          store.reset();
        }
        send_message(response, 400, "Not possible", error.what());
      } catch (const std::exception& error) { send_message(response, 500, "Fault", error.what()); }
    };
  }
  void get(const char* pattern, Answer answer) { server->Get(pattern, guarded(std::move(answer), false)); }
  void post(const char* pattern, Answer answer) { server->Post(pattern, guarded(std::move(answer), true)); }

  static void only_educators(const Visitor& who) {
    if (!who.sees_all()) throw Refused{403, "This page is for educators."};
  }
  static void only_own(const Visitor& who, const std::string& trainee) {
    if (!who.sees_all() && who.name != trainee) throw Refused{404, "There is no such page."};
  }
  Session session_for(const Visitor& who, const std::string& id) {
    if (id.size() > 18) throw Refused{404, "There is no such session."};
    Session s;
    try {
      s = with_store([&](Store& st) { return st.session(std::stoll(id)); });
    } catch (const InputError&) { throw Refused{404, "There is no such session."}; }
    only_own(who, s.trainee);
    return s;
  }
  static SessionFilter filter_of(const Request& request) {
    SessionFilter f;
    f.cohort = parameter(request, "cohort"), f.task = parameter(request, "task");
    f.from = parameter(request, "from"), f.before = parameter(request, "before");
    return f;
  }

  // A recording is served only from the folder beside the store, whatever the path in the database.
  fs::path kept_file(const Session& s, const char* extension) const {
    std::error_code error;
    const fs::path folder = fs::weakly_canonical(fs::absolute(store_folder()) / "recordings", error);
    const fs::path file = fs::weakly_canonical(fs::path(s.recording).replace_extension(extension), error);
    const bool inside = !s.recording.empty() && file.parent_path() == folder && fs::is_regular_file(file, error);
    return inside ? file : fs::path();
  }
  fs::path store_folder() const {
    const std::string where = options.store.where.empty() ? default_store() : options.store.where;
    return fs::path(where).parent_path();
  }
  static void send_file(Response& response, const fs::path& file, const char* type) {
    auto in = std::make_shared<std::ifstream>(file, std::ios::binary);
    response.set_content_provider(fs::file_size(file), type, [in](size_t offset, size_t length, httplib::DataSink& sink) {
      std::string part(std::min<size_t>(length, 1u << 16), '\0');
      in->clear();
      in->seekg(static_cast<std::streamoff>(offset));
      in->read(part.data(), static_cast<std::streamsize>(part.size()));
      return in->gcount() > 0 && sink.write(part.data(), static_cast<size_t>(in->gcount()));
    });
  }

  void routes();
  void survey_routes();
  void login_routes();
};

void PageServer::Work::routes() {
  get("/", [this](const Request&, Response& response, const Visitor& who, const auto&) {
    if (!who.sees_all()) return response.set_redirect("/trainee/" + who.name, 303);
    Json j = Json::parse(with_store([](Store& s) { return overview_data(s); }));
    j["token"] = who.token;
    j["who"] = who.name;
    j["questionnaires"] = questionnaire_names();
    send_page(response, "educator", "Training overview", j.dump());
  });
  get("/session/([0-9]+)", [this](const Request&, Response& response, const Visitor& who, const auto& part) {
    const Session s = session_for(who, part[0]);
    send_page(response, "session", s.task + ": " + s.trainee, with_store([&](Store& st) { return session_data(st, s.id); }));
  });
  get("/trainee/([A-Za-z0-9._-]+)", [this](const Request&, Response& response, const Visitor& who, const auto& part) {
    only_own(who, part[0]);
    std::string data;
    try {
      data = with_store([&](Store& s) { return trainee_data(s, part[0]); });
    } catch (const InputError&) { throw Refused{404, "There is no such trainee."}; }
    send_page(response, "trainee", "Sessions of " + part[0], data);
  });
  get("/api/metric", [this](const Request& request, Response& response, const Visitor& who, const auto&) {
    only_educators(who);
    send_text(response, with_store([&](Store& s) { return metric_data(s, parameter(request, "name"), filter_of(request)); }),
              "application/json");
  });
  get("/export\\.(csv|json|xapi)", [this](const Request& request, Response& response, const Visitor& who, const auto& part) {
    only_educators(who);
    const SessionFilter f = filter_of(request);
    const std::string text = with_store([&](Store& s) {
      s.log(who.name.empty() ? "page" : who.name, "export", part[0]);
      return part[0] == "csv"    ? sessions_csv(s, f)
             : part[0] == "json" ? sessions_to_json(s, f)
                                 : sessions_to_xapi(s, f, options.home);
    });
    response.set_header("Content-Disposition",
                        fmt::format("attachment; filename=\"sessions.{}\"", part[0] == "xapi" ? "xapi.json" : part[0]));
    send_text(response, text, part[0] == "csv" ? "text/csv; charset=utf-8" : "application/json");
  });
  get("/recording/([0-9]+)", [this](const Request&, Response& response, const Visitor& who, const auto& part) {
    const fs::path file = kept_file(session_for(who, part[0]), ".cgrec");
    if (file.empty()) throw Refused{404, "The recording of this session is not kept beside the store."};
    response.set_header("Content-Disposition", fmt::format("attachment; filename=\"session-{}.cgrec\"", part[0]));
    send_file(response, file, "application/octet-stream");
  });
  get("/film/([0-9]+)", [this](const Request&, Response& response, const Visitor& who, const auto& part) {
    const Session s = session_for(who, part[0]);
    const fs::path file = kept_file(s, ".mp4"), recording = kept_file(s, ".cgrec");
    if (!file.empty()) return send_file(response, file, "video/mp4");
    if (recording.empty()) throw Refused{404, "The recording of this session is not kept beside the store."};
    fs::path film = recording;
    send_message(
        response, 404, "No film yet",
        fmt::format(
            "Make it with: catgut replay {} --video {} --video-speed 1. Or look at the session from every side: catgut view {}",
            recording.string(), film.replace_extension(".mp4").string(), recording.string()));
  });
  post("/assignment", [this](const Request& request, Response& response, const Visitor& who, const auto&) {
    only_educators(who);
    Assignment a;
    a.cohort = parameter(request, "cohort"), a.task = parameter(request, "task"), a.due = parameter(request, "due");
    a.goal = number_or_unknown(parameter(request, "goal"));
    const double runs = number_or_unknown(parameter(request, "runs"));
    a.runs = runs >= 1 && runs <= 1000 ? static_cast<int>(runs) : 0;
    with_store([&](Store& s) { return s.add_assignment(a); });
    response.set_redirect("/", 303);
  });
  post("/assignment/remove", [this](const Request& request, Response& response, const Visitor& who, const auto&) {
    only_educators(who);
    const double id = number_or_unknown(parameter(request, "id"));
    with_store([&](Store& s) { s.remove_assignment(std::isfinite(id) ? static_cast<int64_t>(id) : 0); });
    response.set_redirect("/", 303);
  });
}

void PageServer::Work::survey_routes() {
  const auto known = [](const std::string& name) {
    for (const std::string& one : questionnaire_names())
      if (one == name) return read_questionnaire(name);
    throw Refused{404, "There is no such survey."};
  };
  get("/survey/([A-Za-z0-9._-]+)", [this, known](const Request&, Response& response, const Visitor& who, const auto& part) {
    const Questionnaire q = known(part[0]);
    Json j = Json::parse(survey_data(q, {}));
    j["kind"] = "form";
    j["token"] = who.token;
    j["respondent"] = who.name;
    send_page(response, "form", q.title, j.dump());
  });
  get("/survey/([A-Za-z0-9._-]+)/results",
      [this, known](const Request&, Response& response, const Visitor& who, const auto& part) {
        only_educators(who);
        const Questionnaire q = known(part[0]);
        const std::vector<SurveyAnswer> answers = with_store([&](Store& s) { return s.answers(q.name); });
        send_page(response, "survey", q.title, survey_data(q, evaluate(q, answers)));
      });
  post("/survey/([A-Za-z0-9._-]+)",
       [this, known](const Request& request, Response& response, const Visitor& who, const auto& part) {
         const Questionnaire q = known(part[0]);
         const std::string respondent = who.sees_all() ? parameter(request, "respondent") : who.name, now = utc_now();
         if (respondent.empty()) throw Refused{400, "The pseudonym or number is missing."};
         std::vector<SurveyAnswer> answers;
         for (const Question& one : q.question) {
           const std::string given = parameter(request, ("q." + one.key).c_str());
           if (given.empty()) continue;
           SurveyAnswer a{q.name, q.version, respondent, parameter(request, "group"), now, one.key, kUnknown, ""};
           if (one.free) a.text = given;
           else a.value = number_or_unknown(given);
           answers.push_back(a);
         }
         check_answers(q, answers);
         if (answers.empty()) throw Refused{400, "No question was answered."};
         with_store([&](Store& s) { s.add_answers(answers); });
         send_message(response, 200, "Thank you", "Your answers are stored.");
       });
}

void PageServer::Work::login_routes() {
  server->Get("/login",
              [this](const Request&, Response& response) { send_page(response, "login", "Sign in", R"({"kind": "login"})"); });
  server->Post("/login", [this](const Request& request, Response& response) {
    const std::string name = parameter(request, "name");
    const auto now = Visitors::Clock::now();
    const auto refuse = [&](const char* fault) {
      send_page(response, "login", "Sign in", Json({{"kind", "login"}, {"fault", fault}}).dump(), 403);
    };
    try {
      if (!visitors.may_try(name, now)) return refuse("Too many attempts. Wait half a minute.");
      const std::string hash = with_store([&](Store& s) { return s.login(name); });
      // The same work for an unknown name: the time shows nothing.
      static const std::string kNone = hash_password(random_token());
      if (!password_matches(hash.empty() ? kNone : hash, parameter(request, "password"))) {
        visitors.failed(name, now);
        return refuse("Pseudonym or password is wrong.");
      }
      visitors.succeeded(name);
      const Role role = with_store([&](Store& s) { return s.person(name).role; });
      response.set_header("Set-Cookie",
                          fmt::format("catgut={}; Path=/; HttpOnly; SameSite=Strict{}", visitors.enter(name, role, now),
                                      tls() || options.behind_proxy ? "; Secure" : ""));
      response.set_redirect("/", 303);
    } catch (const std::exception& error) { send_message(response, 500, "Fault", error.what()); }
  });
  post("/logout", [this](const Request& request, Response& response, const Visitor&, const auto&) {
    visitors.leave(cookie_of(request));
    response.set_redirect("/login", 303);
  });
}

PageServer::PageServer(const ServeOptions& options) : work_(std::make_unique<Work>()) {
  Work& w = *work_;
  w.options = options;
  w.store = std::make_unique<Store>(options.store);
  const std::string where = fmt::format("{}:{}", options.host, options.port);
  if (options.certificate.empty() != options.key.empty())
    throw InputError("serve", "a certificate needs its key", "give --tls-cert and --tls-key");
  if (!is_loopback(options.host)) {
    if (w.store->logins() == 0)
      throw InputError(where, "other machines could read everything, as the store has no login",
                       "make one first: catgut store person NAME --role educator; catgut store login NAME");
    if (!w.tls() && !options.behind_proxy)
      throw InputError(where, "passwords would cross the network in clear text",
                       "give --tls-cert and --tls-key, or --behind-tls-proxy when a proxy adds TLS");
  }
  if (w.tls()) w.server = std::make_unique<httplib::SSLServer>(options.certificate.c_str(), options.key.c_str());
  else w.server = std::make_unique<httplib::Server>();
  if (!w.server->is_valid())
    throw InputError(options.certificate, "certificate or key cannot be used", "check that both are PEM files of each other");
  w.server->new_task_queue = [] { return new httplib::ThreadPool(4); };
  // The default lets a second program listen on the same port and receive some of the visitors.
  w.server->set_socket_options([](socket_t socket) {
    const int yes = 1;
    setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  });
  w.server->set_payload_max_length(1u << 20);
  w.server->set_read_timeout(10);
  w.server->set_write_timeout(30);
  w.server->set_keep_alive_max_count(100);
  w.server->set_default_headers({{"X-Content-Type-Options", "nosniff"},
                                 {"Referrer-Policy", "same-origin"},
                                 {"Cache-Control", "no-store"},
                                 {"Cross-Origin-Opener-Policy", "same-origin"}});
  w.server->set_pre_routing_handler([&w](const Request& request, Response& response) {
    // The routes are regular expressions, whose cost grows with the path.
    if (request.path.size() > 200 || w.wrong_host(request)) {
      response.status = request.path.size() > 200 ? 414 : 421;
      response.set_content("not here\n", "text/plain");
      return httplib::Server::HandlerResponse::Handled;
    }
    return httplib::Server::HandlerResponse::Unhandled;
  });
  w.server->set_error_handler([&w](const Request&, Response& response) {
    if (response.body.empty() && !response.has_header("Content-Security-Policy"))
      w.send_message(response, response.status, "Not found", "There is no such page.");
  });
  w.routes();
  w.survey_routes();
  w.login_routes();
  w.port = options.port == 0                                    ? w.server->bind_to_any_port(options.host)
           : w.server->bind_to_port(options.host, options.port) ? options.port
                                                                : -1;
  if (w.port <= 0)
    throw InputError(where, "cannot listen there: the port is in use or the address is not of this machine",
                     "choose another --port or --listen");
  w.thread = std::thread([&w] { w.server->listen_after_bind(); });
}

PageServer::~PageServer() {
  if (!work_->thread.joinable()) return;
  while (!work_->server->is_running()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  work_->server->stop();
  work_->thread.join();
}

std::string PageServer::url() const {
  const std::string& host = work_->options.host;
  return fmt::format("{}://{}:{}/", work_->tls() ? "https" : "http",
                     host.find(':') == std::string::npos ? host : "[" + host + "]", work_->port);
}

}  // namespace catgut
