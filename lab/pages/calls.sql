-- What did the model calls cost, by provider and purpose?
SELECT split_part(call_model, '/', 1) AS provider, purpose, count(*) AS calls, count(*) FILTER (cached) AS cached,
    coalesce(sum(prompt_tokens + completion_tokens) FILTER (NOT cached), 0)::BIGINT AS tokens,
    round(coalesce(sum(cost_usd) FILTER (NOT cached), 0), 2) AS usd
FROM model_calls GROUP BY ALL ORDER BY usd DESC, tokens DESC, purpose
