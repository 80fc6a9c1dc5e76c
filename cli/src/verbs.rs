//! One file per verb, and the way from the command line to them.

mod check;
mod eval;
mod explain;
mod generate;
mod list;
mod replay;
mod robot;
mod run;
mod show;
mod test;

use crate::arguments::{Arguments, Format, Verb};
use crate::failure::Failure;
use crate::session::Session;
use crate::systems::Catalog;

pub(crate) fn run(catalog: &Catalog, arguments: &Arguments) -> Result<(), Failure> {
    if arguments.threads == Some(0) {
        return Err(Failure::Usage("found --threads 0, wanted at least 1".into()));
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(arguments.threads.unwrap_or(0));
    // This thread is one of them: to wake another one for it costs more than many a job. A lone thread is another one:
    // a system that waits for a thread of its own must not wait for this one.
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let pool = if arguments.threads.unwrap_or(cores) > 1 { pool.use_current_thread() } else { pool };
    // A program that has a pool already keeps it, unless it is told otherwise.
    if let (Err(error), Some(_)) = (pool.build_global(), arguments.threads) {
        return Err(Failure::Internal(error.to_string()));
    }
    match &arguments.verb {
        Verb::Run(verb) => run::run(catalog, arguments, verb),
        Verb::Test(verb) => test::test(catalog, arguments, verb),
        Verb::Gen(verb) => generate::generate(arguments, verb),
        Verb::Replay(verb) => replay::replay(catalog, arguments, verb),
        Verb::Eval(verb) => eval::eval(arguments, verb),
        Verb::Explain(verb) => explain::explain(verb),
        Verb::Check { files } => check::check(files),
        Verb::Show(verb) => show::show(verb),
        Verb::List => {
            list::list(catalog);
            Ok(())
        }
    }
}

fn print(session: &Session, resolved: &str, format: Format) {
    match format {
        Format::Human => print!("{}", crate::table::render(session)),
        Format::Json => print!("{}", crate::output::metrics(session, resolved)),
    }
}

/// The verdict as the verb's result; everything is written by now.
fn verdict(session: &Session) -> Result<(), Failure> {
    if session.interrupted() {
        return Err(Failure::Interrupted);
    }
    if session.passed() {
        return Ok(());
    }
    let failed = session.findings.iter().filter(|finding| !finding.passed).map(|finding| finding.line());
    let damage = session.damage.iter().map(|damage| format!("the recording breaks off: {damage}"));
    Err(Failure::Expectation(failed.chain(damage).collect::<Vec<_>>().join("; ")))
}
