#pragma once
// Flies the recorded operations once more in one form of the filter, beside a reference.

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "test/budget/filter_forms/covariance_forms.h"
#include "test/budget/instruction_mark.h"

namespace plumb::budget {

/// What the reference made of the operations of one image.
struct ReferenceImage {
  std::vector<std::vector<long double>> corrections;  ///< of each update
  std::vector<std::vector<long double>> sigmas;       ///< behind each update
  std::vector<long double> last_sigmas;               ///< at the end of the image; 0 for what is not in use
};

/// Of one form, a number for each image.
struct Record {
  std::vector<double> time_ms;
  std::vector<double> correction_error;     ///< largest of K r, in sigma
  std::vector<double> sigma_error;          ///< largest, relative
  std::vector<double> smallest_eigenvalue;  ///< of the correlations
  std::size_t indefinite = 0;               ///< images
  std::size_t failed_updates = 0;
};

inline std::vector<long double> sigmas_of(const Table<long double>& p) {
  std::vector<long double> sigmas;
  for (Eigen::Index i = 0; i < p.rows(); ++i) sigmas.push_back(p(i, i) > 0 ? std::sqrt(p(i, i)) : 0.0L);
  return sigmas;
}

/// Definiteness of the covariance of the states in use.
struct Definiteness {
  bool positive = false;
  double smallest_eigenvalue = 0.0;  ///< of the correlations
};
Definiteness definiteness_of(const Table<long double>& p);

class Contestant {
 public:
  virtual ~Contestant() = default;
  virtual const std::string& name() const = 0;
  /// Repeats the operations of one image, `rounds` times for the time. The record grows if the image `counts`.
  virtual void repeat(const std::vector<Operation<double>>& operations, const ReferenceImage& reference, int rounds,
                      bool counts) = 0;
  /// Repeats them once; if the image `counts`, between marks with this number.
  virtual void count(const std::vector<Operation<double>>& operations, std::uint8_t number, bool counts) = 0;
  virtual Table<long double> covariance() const = 0;
  const Record& record() const { return record_; }

 protected:
  Record record_;
};

template <class Form>
class FormContestant final : public Contestant {
 public:
  using Number = typename Form::Number;

  explicit FormContestant(std::string name) : name_(std::move(name)) {}
  const std::string& name() const override { return name_; }
  Table<long double> covariance() const override { return form_->covariance(); }

  void count(const std::vector<Operation<double>>& operations, std::uint8_t number, bool counts) override {
    const std::vector<Operation<Number>> own = in_own_numbers(operations);
    if (counts) begin(number);
    for (const Operation<Number>& operation : own) static_cast<void>(form_->apply(operation));
    if (counts) end(number);
  }

  void repeat(const std::vector<Operation<double>>& operations, const ReferenceImage& reference, int rounds,
              bool counts) override {
    const std::vector<Operation<Number>> own = in_own_numbers(operations);
    if (counts) record_.time_ms.push_back(time_ms(own, rounds));
    double correction_error = 0.0;
    std::size_t updates = 0;
    bool judged = false;
    for (const Operation<Number>& operation : own) {
      // A pose and its copy are one: the covariance is singular from then on until the core moves away from it.
      if (counts && !judged && operation.kind == Kind::kClone) {
        judge_definiteness();
        judged = true;
      }
      if (!form_->apply(operation)) ++record_.failed_updates;
      if (operation.kind != Kind::kUpdate) continue;
      for (std::size_t i = 0; i < form_->correction().size(); ++i) {
        const long double sigma = reference.sigmas[updates][i];
        if (sigma == 0.0L) continue;
        const long double off = form_->correction()[i] - reference.corrections[updates][i];
        correction_error = larger(correction_error, off / sigma);
      }
      ++updates;
    }
    if (!counts) return;
    record_.correction_error.push_back(correction_error);
    record_.sigma_error.push_back(sigma_error(reference.last_sigmas));
  }

 private:
  static std::vector<Operation<Number>> in_own_numbers(const std::vector<Operation<double>>& operations) {
    std::vector<Operation<Number>> own;
    for (const Operation<double>& operation : operations) own.push_back(operation.template cast<Number>());
    return own;
  }

  /// What is no number is larger than any.
  static double larger(double worst, long double error) {
    return std::isnan(error) ? std::numeric_limits<double>::infinity()
                             : std::max(worst, static_cast<double>(std::abs(error)));
  }

  /// The shortest: what else the machine does only adds.
  double time_ms(const std::vector<Operation<Number>>& operations, int rounds) const {
    double best = std::numeric_limits<double>::infinity();
    for (int round = 0; round < rounds; ++round) {
      *trial_ = *form_;
      const auto begin = std::chrono::steady_clock::now();
      for (const Operation<Number>& operation : operations) static_cast<void>(trial_->apply(operation));
      const std::chrono::duration<double, std::milli> taken = std::chrono::steady_clock::now() - begin;
      best = std::min(best, taken.count());
    }
    return best;
  }

  void judge_definiteness() {
    const Definiteness found = definiteness_of(form_->covariance());
    record_.smallest_eigenvalue.push_back(found.smallest_eigenvalue);
    record_.indefinite += found.positive ? 0 : 1;
  }

  double sigma_error(const std::vector<long double>& expected) const {
    const std::vector<long double> sigmas = sigmas_of(form_->covariance());
    double worst = 0.0;
    for (std::size_t i = 0; i < expected.size(); ++i) {
      if (expected[i] > 0.0L) worst = larger(worst, sigmas[i] / expected[i] - 1.0L);
    }
    return worst;
  }

  std::string name_;
  std::unique_ptr<Form> form_ = std::make_unique<Form>();
  std::unique_ptr<Form> trial_ = std::make_unique<Form>();
};

/// The covariance form in long double.
class Reference {
 public:
  ReferenceImage repeat(const std::vector<Operation<double>>& operations);
  Table<long double> covariance() const { return form_->covariance(); }

 private:
  std::unique_ptr<CovarianceForm<long double>> form_ = std::make_unique<CovarianceForm<long double>>();
};

}  // namespace plumb::budget
