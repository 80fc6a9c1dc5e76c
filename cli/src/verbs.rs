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
    if let Some(threads) = arguments.threads {
        if threads == 0 {
            return Err(Failure::Usage("found --threads 0, wanted at least 1".into()));
        }
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build_global()
            .map_err(|error| Failure::Internal(error.to_string()))?;
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
