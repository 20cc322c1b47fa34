// iiwa-sim for tests in C++: a driver's connection, the backdoor, and a simulator. POSIX, C++17, this one file.
//
//     Simulator simulator({"--clock", "fast"});  // starts iiwa-sim, which has to be in PATH, and ends it
//     Robot robot(simulator.host(), simulator.port());
//     Backdoor backdoor(simulator.host(), simulator.backdoor_port());
//     backdoor.call("emergency_stop");
//
// Every failure is a std::runtime_error.

#pragma once

#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <iomanip>
#include <iostream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

// A connected socket. Each wait for it ends after `timeout_s`.
inline int connected(const std::string& host, const std::string& port, int timeout_s) {
    addrinfo hints{};
    hints.ai_socktype = SOCK_STREAM;
    addrinfo* found = nullptr;
    if (const int fault = getaddrinfo(host.c_str(), port.c_str(), &hints, &found); fault != 0)
        throw std::runtime_error(host + ": " + gai_strerror(fault));
    int made = -1;
    for (const addrinfo* each = found; each != nullptr && made < 0; each = each->ai_next) {
        made = socket(each->ai_family, each->ai_socktype, each->ai_protocol);
        if (made >= 0 && connect(made, each->ai_addr, each->ai_addrlen) != 0) {
            close(made);
            made = -1;
        }
    }
    freeaddrinfo(found);
    if (made < 0) throw std::runtime_error("cannot connect to " + host + ":" + port);
    const timeval timeout{timeout_s, 0};
    const int on = 1;
    setsockopt(made, SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof timeout);
    setsockopt(made, SOL_SOCKET, SO_SNDTIMEO, &timeout, sizeof timeout);
    setsockopt(made, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    return made;
}

inline void send_all(int socket, const std::string& data) {
    for (size_t at = 0; at < data.size();) {
        const ssize_t count = send(socket, data.data() + at, data.size() - at, MSG_NOSIGNAL);
        if (count <= 0) throw std::runtime_error("the connection failed at '" + data.substr(0, data.find('\r')) + "'");
        at += static_cast<size_t>(count);
    }
}

// One connection. Each command is a line, and is answered by one line.
class Robot {
public:
    Robot(const std::string& host, const std::string& port, int timeout_s = 5)
        : socket_(connected(host, port, timeout_s)) {}

    // The robot stops if a move of this connection still runs.
    ~Robot() { close(socket_); }

    Robot(const Robot&) = delete;
    Robot& operator=(const Robot&) = delete;

    // Return the reply to a line, also an error.
    std::string ask(const std::string& line) {
        send_all(socket_, line + "\r\n");
        size_t end;
        while ((end = heard_.find("\r\n")) == std::string::npos) {
            char buffer[1024];
            const ssize_t count = recv(socket_, buffer, sizeof buffer, 0);
            if (count <= 0) throw std::runtime_error("no reply to '" + line + "'");
            heard_.append(buffer, static_cast<size_t>(count));
        }
        const std::string reply = heard_.substr(0, end);
        heard_.erase(0, end + 2);
        return reply;
    }

    // Send a command with its parameters; throw if the reply is not `done`.
    void command(const std::string& name, const std::vector<double>& parameters = {}) {
        std::ostringstream line;
        line << std::setprecision(12) << name << (parameters.empty() ? "" : " :");
        for (const double each : parameters) line << ' ' << each;
        if (const std::string reply = ask(line.str()); reply != "done") {
            const std::string reason = reply == "error" ? ": " + ask("get error") : "";
            throw std::runtime_error("'" + line.str() + "' was answered '" + reply + "'" + reason);
        }
    }

    // Return the numbers in the reply to a `get` command.
    std::vector<double> numbers(const std::string& name, size_t expected) {
        const std::string reply = ask(name);
        std::istringstream words(reply);
        std::vector<double> values;
        for (double value; words >> value;) values.push_back(value);
        if (!words.eof() || values.size() != expected)
            throw std::runtime_error("'" + name + "' was answered '" + reply + "'");
        return values;
    }

    // Poll the status: `done` only says that a move was accepted.
    void wait_until_stopped(std::chrono::seconds limit) {
        const auto deadline = std::chrono::steady_clock::now() + limit;
        while (ask("get status") != "stopped") {
            if (std::chrono::steady_clock::now() > deadline) throw std::runtime_error("the robot still moves");
            std::this_thread::sleep_for(std::chrono::milliseconds(20));  // 50 Hz
        }
    }

private:
    const int socket_;
    std::string heard_;
};

// Fault injection over HTTP: docs/backdoor.md lists the calls.
class Backdoor {
public:
    Backdoor(const std::string& host, const std::string& port, const std::string& token = "")
        : host_(host), port_(port), token_(token) {}

    // Return the reply to a call with these arguments, both in JSON.
    std::string call(const std::string& name, const std::string& arguments = "{}", int timeout_s = 60) {
        const int socket = connected(host_, port_, timeout_s);
        std::string answer;
        ssize_t count = 0;
        try {
            send_all(socket, "POST /" + name + " HTTP/1.1\r\nHost: " + host_ + "\r\nConnection: close\r\n" +
                                 (token_.empty() ? "" : "Authorization: Bearer " + token_ + "\r\n") +
                                 "Content-Length: " + std::to_string(arguments.size()) + "\r\n\r\n" + arguments);
            char buffer[4096];
            while ((count = recv(socket, buffer, sizeof buffer, 0)) > 0) answer.append(buffer, static_cast<size_t>(count));
        } catch (...) {
            close(socket);
            throw;
        }
        close(socket);
        const size_t head = answer.find("\r\n\r\n");
        if (count < 0 || head == std::string::npos) throw std::runtime_error("no answer to '" + name + "'");
        const std::string body = answer.substr(head + 4);
        if (answer.compare(0, 13, "HTTP/1.1 200 ") != 0) throw std::runtime_error("'" + name + "': " + body);
        return body;
    }

private:
    const std::string host_, port_, token_;
};

// An iiwa-sim on free ports, with a backdoor; it ends with this object.
class Simulator {
public:
    explicit Simulator(const std::vector<std::string>& options = {}, const std::string& program = "iiwa-sim") {
        std::vector<std::string> words = {program, "--port", "0", "--backdoor-port", "0"};
        words.insert(words.end(), options.begin(), options.end());
        std::vector<char*> arguments;
        for (std::string& word : words) arguments.push_back(word.data());
        arguments.push_back(nullptr);
        int ends[2];
        if (pipe(ends) != 0) throw std::runtime_error("no pipe");
        child_ = fork();
        if (child_ == 0) {
            dup2(ends[1], STDOUT_FILENO);
            close(ends[0]);
            close(ends[1]);
            execvp(arguments[0], arguments.data());
            _exit(127);
        }
        close(ends[1]);
        said_ = ends[0];
        if (child_ < 0) throw std::runtime_error("no process");
        try {
            port_ = announced("listening on ");
            backdoor_port_ = announced("backdoor on ");
        } catch (...) {
            end();
            throw;
        }
    }

    ~Simulator() { end(); }

    Simulator(const Simulator&) = delete;
    Simulator& operator=(const Simulator&) = delete;

    const std::string& host() const { return host_; }
    const std::string& port() const { return port_; }
    const std::string& backdoor_port() const { return backdoor_port_; }

private:
    // Return the port in the next line, which begins with these words.
    std::string announced(const std::string& begins) {
        std::string line;
        for (char letter; read(said_, &letter, 1) == 1 && letter != '\n';) line += letter;
        if (line.compare(0, begins.size(), begins) != 0)
            throw std::runtime_error("iiwa-sim did not start: it says why on stderr, if it is in PATH");
        return line.substr(line.rfind(':') + 1);
    }

    void end() {
        kill(child_, SIGTERM);
        waitpid(child_, nullptr, 0);
        close(said_);
    }

    const std::string host_ = "127.0.0.1";
    std::string port_, backdoor_port_;
    pid_t child_ = -1;
    int said_ = -1;
};
